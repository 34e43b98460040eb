-- title: ROS objects
-- description: Every publisher, subscription, timer, service and client with its node and process,
--     and every action server and client, which are made of these. Timers with neither node nor
--     callback are counted: rclpy makes one whenever it waits.
-- grain: one row per object; one per process for all its timers with neither node nor callback
-- param: kind VARCHAR {publisher|subscription|timer|service|client|action_server|action_client} =
--     NULL  Kind of object (default: all)
-- column: run_id, host, process, pid
-- column: node VARCHAR [node]  Full name of the node; empty: not known
-- column: kind VARCHAR              Kind of object
-- column: name VARCHAR [topic]  Topic, service, action, or period of the timer; number of those
--     timers
-- column: queue_depth BIGINT        History depth asked for
-- column: goals BIGINT              Goals that an action server took, or an action client sent;
--     empty for both: the trace would not show goals
-- column: created_ns BIGINT [epoch ns]  First initialisation event
-- column: symbols VARCHAR           Functions registered for its callbacks
-- column: object_id BIGINT          Identity within its kind; of those timers, the first one's
-- column: is_inferred BOOLEAN       Its initialisation was not recorded
-- column: is_internal
-- brief: kind, name, node, process, pid, host, queue_depth, goals, created_ns, symbols
WITH nameless_timer AS (
    FROM main.timer AS t
    ANTI JOIN main.callback AS c ON t.timer_id = c.timer_id
    WHERE t.node_id IS NULL
),
object AS (
    SELECT
        run_id, process_id, node_id,
        'publisher' AS kind,
        topic_name AS name,
        queue_depth,
        NULL::BIGINT AS goals,
        created_ns,
        publisher_id AS object_id,
        is_inferred, is_internal
    FROM main.publisher
    UNION ALL
    SELECT
        run_id, process_id, node_id, 'subscription', topic_name, queue_depth, NULL, created_ns,
        subscription_id, is_inferred, is_internal
    FROM main.subscription
    UNION ALL
    SELECT
        run_id, process_id, node_id, 'timer',
        printf('%.10g ms', period_ns / 1e6),
        NULL, NULL, created_ns, timer_id, is_inferred, false
    FROM main.timer
    ANTI JOIN nameless_timer USING (timer_id)
    UNION ALL
    SELECT
        run_id, process_id, NULL, 'timer',
        printf('%d without node and callback', count(*)),
        NULL, NULL,
        min(created_ns),
        min(timer_id),
        count(created_ns) = 0,
        false
    FROM nameless_timer
    GROUP BY run_id, process_id
    UNION ALL
    SELECT
        run_id, process_id, node_id, 'service', service_name, NULL, NULL, created_ns, service_id,
        is_inferred, is_internal
    FROM main.service
    UNION ALL
    SELECT
        run_id, process_id, node_id, 'client', service_name, NULL, NULL, created_ns, client_id,
        is_inferred, is_internal
    FROM main.client
    UNION ALL
    SELECT
        a.run_id, a.process_id, a.node_id, 'action_server', a.action_name, NULL, a.goal_count,
        a.created_ns, a.action_server_id, s.is_inferred, s.is_internal
    FROM main.action_server AS a
    JOIN main.service AS s ON a.action_server_id = s.service_id
    UNION ALL
    SELECT
        a.run_id, a.process_id, a.node_id, 'action_client', a.action_name, NULL, a.goal_count,
        a.created_ns, a.action_client_id, c.is_inferred, c.is_internal
    FROM main.action_client AS a
    JOIN main.client AS c ON a.action_client_id = c.client_id
),
symbol AS (
    SELECT
        kind,
        coalesce(subscription_id, timer_id, service_id) AS object_id,
        string_agg(DISTINCT symbol, '; ' ORDER BY symbol) AS symbols
    FROM main.callback
    WHERE symbol IS NOT NULL AND kind <> 'unknown'
    GROUP BY ALL
)
SELECT
    o.run_id,
    h.hostname AS host,
    p.name AS process,
    p.pid,
    n.full_name AS node,
    o.kind, o.name, o.queue_depth, o.goals, o.created_ns, s.symbols, o.object_id, o.is_inferred,
    o.is_internal
FROM object AS o
JOIN main.process AS p ON o.process_id = p.process_id
JOIN main.host AS h ON p.host_id = h.host_id
LEFT JOIN main.node AS n ON o.node_id = n.node_id
LEFT JOIN symbol AS s ON o.kind = s.kind AND o.object_id = s.object_id
WHERE list_contains($runs, o.run_id) AND ($kind IS NULL OR o.kind = $kind)
ORDER BY o.run_id, host, p.pid, p.process_id, node NULLS LAST, o.kind, o.name, o.object_id
