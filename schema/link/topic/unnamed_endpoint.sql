-- description: Publishers and subscriptions whose topic the trace does not name, and what an entry
--     of a file of links knows them by. A handle that occurs twice needs its process and host.
-- grain: one row per publisher or subscription that was used, and not seen to be initialised
CREATE OR REPLACE MACRO derive.unnamed_endpoint(only_run) AS TABLE
WITH endpoint AS (
    SELECT
        run_id,
        'publisher' AS kind,
        publisher_id AS id,
        publisher_id AS vertex,
        process_id, node_id,
        coalesce(publisher_handle, rmw_handle) AS handle,
        topic_name, is_topic_learned, is_topic_declared
    FROM store.publisher
    WHERE run_id = only_run
    UNION ALL
    SELECT
        run_id, 'subscription', subscription_id,
        -subscription_id,
        process_id, node_id,
        coalesce(subscription_handle, rmw_handle),
        topic_name, is_topic_learned, is_topic_declared
    FROM store.subscription
    WHERE run_id = only_run
),
counted AS (
    SELECT
        *,
        count(*) OVER (PARTITION BY kind, handle) > 1 AS is_handle_repeated
    FROM endpoint
)
SELECT
    e.run_id, e.kind, e.id, e.vertex, e.node_id, e.handle, e.topic_name, e.is_topic_declared,
    p.name AS process_name,
    p.pid, h.hostname,
    printf('%s: 0x%x', e.kind, e.handle)
    || CASE
        WHEN e.is_handle_repeated
        THEN printf(', process: %d, host: %s', p.pid, to_json(h.hostname))
        ELSE '' END AS entry
FROM counted AS e
JOIN store.process AS p ON e.process_id = p.process_id
JOIN store.host AS h ON p.host_id = h.host_id
WHERE e.handle IS NOT NULL AND (e.topic_name IS NULL OR e.is_topic_learned OR e.is_topic_declared)
