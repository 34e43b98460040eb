-- description: Services, clients, publishers and subscriptions of actions, by what their names say:
--     those of the action /dock are called /dock/_action/send_goal, and so on.
-- grain: one row per such object
WITH named AS (
    SELECT
        run_id, process_id, node_id,
        'service' AS kind,
        service_id AS object_id,
        service_name AS name,
        created_ns
    FROM store.service
    UNION ALL
    SELECT run_id, process_id, node_id, 'client', client_id, service_name, created_ns
    FROM store.client
    UNION ALL
    SELECT run_id, process_id, node_id, 'publisher', publisher_id, topic_name, created_ns
    FROM store.publisher
    UNION ALL
    SELECT run_id, process_id, node_id, 'subscription', subscription_id, topic_name, created_ns
    FROM store.subscription
)
SELECT
    run_id, process_id, node_id, kind, object_id, created_ns,
    regexp_extract(name, '^(.*)/_action/', 1) AS action_name,
    regexp_extract(name, '[^/]*$') AS part
FROM named
WHERE name LIKE '%/\_action/%' ESCAPE '\'
