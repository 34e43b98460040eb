-- title: Rows per table
-- description: How many rows each view has for a run, from hosts to links. Empty views are listed
--     too.
-- grain: one row per run and view
-- column: run_id BIGINT      Run
-- column: object VARCHAR     View that holds the rows
-- column: row_count BIGINT   Rows
WITH object AS (
    SELECT
        unnest([
            'host', 'process', 'thread', 'node', 'publisher', 'subscription', 'timer',
            'service', 'client', 'action_server', 'action_client', 'callback', 'executor',
            'publication', 'take', 'callback_instance', 'request', 'response', 'goal',
            'link_transport', 'link_causal'
        ]) AS object,
        unnest(range(21)) AS position
),

counted AS (
    SELECT 'host' AS object, run_id FROM main.host
    UNION ALL
    SELECT 'process' AS object, run_id FROM main.process
    UNION ALL
    SELECT 'thread' AS object, run_id FROM main.thread
    UNION ALL
    SELECT 'node' AS object, run_id FROM main.node
    UNION ALL
    SELECT 'publisher' AS object, run_id FROM main.publisher
    UNION ALL
    SELECT 'subscription' AS object, run_id FROM main.subscription
    UNION ALL
    SELECT 'timer' AS object, run_id FROM main.timer
    UNION ALL
    SELECT 'service' AS object, run_id FROM main.service
    UNION ALL
    SELECT 'client' AS object, run_id FROM main.client
    UNION ALL
    SELECT 'action_server' AS object, run_id FROM main.action_server
    UNION ALL
    SELECT 'action_client' AS object, run_id FROM main.action_client
    UNION ALL
    SELECT 'callback' AS object, run_id FROM main.callback
    UNION ALL
    SELECT 'executor' AS object, run_id FROM main.executor
    UNION ALL
    SELECT 'publication' AS object, run_id FROM main.publication
    UNION ALL
    SELECT 'take' AS object, run_id FROM main.take
    UNION ALL
    SELECT 'callback_instance' AS object, run_id FROM main.callback_instance
    UNION ALL
    SELECT 'request' AS object, run_id FROM main.request
    UNION ALL
    SELECT 'response' AS object, run_id FROM main.response
    UNION ALL
    SELECT 'goal' AS object, run_id FROM main.goal
    UNION ALL
    SELECT 'link_transport' AS object, run_id FROM main.link_transport
    UNION ALL
    SELECT 'link_causal' AS object, run_id FROM main.link_causal
),

found AS (
    SELECT run_id, object, count(*) AS row_count
    FROM counted
    WHERE list_contains($runs, run_id)
    GROUP BY run_id, object
)
SELECT run.run_id, object.object, coalesce(found.row_count, 0) AS row_count
FROM main.run
CROSS JOIN object
LEFT JOIN found ON run.run_id = found.run_id AND object.object = found.object
WHERE list_contains($runs, run.run_id)
ORDER BY run.run_id, object.position
