-- title: ROS nodes
-- description: The nodes of a run, and how many publishers, subscriptions, timers, services,
--     clients, action servers and action clients each has. An action server has three of the
--     services, an action client three of the clients. What ROS adds to every node (parameter
--     services, /rosout, /parameter_events) is not counted.
-- grain: one row per node
-- column: run_id
-- column: node VARCHAR [node]  Namespace and name
-- column: process_name VARCHAR        Process it runs in
-- column: pid INTEGER                 Id of that process
-- column: publisher_count, subscription_count
-- column: timer_count BIGINT          Timers
-- column: service_count BIGINT        Services
-- column: client_count BIGINT         Service clients
-- column: action_server_count BIGINT  Action servers
-- column: action_client_count BIGINT  Action clients
-- brief: node, process_name, publisher_count, subscription_count, timer_count, service_count,
--     client_count, action_server_count, action_client_count, pid
SELECT
    n.run_id,
    n.full_name AS node,
    p.name AS process_name,
    p.pid,
    (SELECT count(*) FROM main.publisher WHERE node_id = n.node_id AND NOT is_internal)
        AS publisher_count,
    (SELECT count(*) FROM main.subscription WHERE node_id = n.node_id AND NOT is_internal)
        AS subscription_count,
    (SELECT count(*) FROM main.timer WHERE node_id = n.node_id) AS timer_count,
    (SELECT count(*) FROM main.service WHERE node_id = n.node_id AND NOT is_internal)
        AS service_count,
    (SELECT count(*) FROM main.client WHERE node_id = n.node_id AND NOT is_internal)
        AS client_count,
    (SELECT count(*) FROM main.action_server WHERE node_id = n.node_id)
        AS action_server_count,
    (SELECT count(*) FROM main.action_client WHERE node_id = n.node_id)
        AS action_client_count
FROM main.node AS n
JOIN main.process AS p ON n.process_id = p.process_id
WHERE list_contains($runs, n.run_id)
ORDER BY n.run_id, n.full_name, n.node_id
