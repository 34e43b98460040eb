-- name: info-counts
-- title: Rows per table
-- description: How much of everything a run holds, in the order from hosts to links.
-- grain: one row per run and view
-- column: run_id BIGINT      Run
-- column: object VARCHAR     View that holds the rows
-- column: row_count BIGINT   Rows
-- needs: main.host, main.process, main.thread, main.node, main.publisher, main.subscription,
--     main.timer, main.service, main.client, main.callback, main.executor, main.publication,
--     main.take, main.callback_instance, main.request, main.response, main.link_transport,
--     main.link_causal
WITH counted AS (
    SELECT 1 AS position, 'host' AS object, run_id FROM main.host
    UNION ALL
    SELECT 2 AS position, 'process' AS object, run_id FROM main.process
    UNION ALL
    SELECT 3 AS position, 'thread' AS object, run_id FROM main.thread
    UNION ALL
    SELECT 4 AS position, 'node' AS object, run_id FROM main.node
    UNION ALL
    SELECT 5 AS position, 'publisher' AS object, run_id FROM main.publisher
    UNION ALL
    SELECT 6 AS position, 'subscription' AS object, run_id FROM main.subscription
    UNION ALL
    SELECT 7 AS position, 'timer' AS object, run_id FROM main.timer
    UNION ALL
    SELECT 8 AS position, 'service' AS object, run_id FROM main.service
    UNION ALL
    SELECT 9 AS position, 'client' AS object, run_id FROM main.client
    UNION ALL
    SELECT 10 AS position, 'callback' AS object, run_id FROM main.callback
    UNION ALL
    SELECT 11 AS position, 'executor' AS object, run_id FROM main.executor
    UNION ALL
    SELECT 12 AS position, 'publication' AS object, run_id FROM main.publication
    UNION ALL
    SELECT 13 AS position, 'take' AS object, run_id FROM main.take
    UNION ALL
    SELECT 14 AS position, 'callback_instance' AS object, run_id FROM main.callback_instance
    UNION ALL
    SELECT 15 AS position, 'request' AS object, run_id FROM main.request
    UNION ALL
    SELECT 16 AS position, 'response' AS object, run_id FROM main.response
    UNION ALL
    SELECT 17 AS position, 'link_transport' AS object, run_id FROM main.link_transport
    UNION ALL
    SELECT 18 AS position, 'link_causal' AS object, run_id FROM main.link_causal
)
SELECT run_id, object, count(*) AS row_count
FROM counted
WHERE list_contains($runs, run_id)
GROUP BY run_id, position, object
ORDER BY run_id, position
