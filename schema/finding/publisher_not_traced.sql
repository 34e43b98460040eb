-- name: finding.publisher_not_traced
-- title: Messages come from a publisher that is not traced
-- description: Messages were taken that nobody in the traces published, although the known
--     publishers of the topic were recorded at that time. Their flows begin at the take.
-- cause: A node on another host or in another container is not part of the recording, or it runs
--     with a tracetools without LTTng.
-- cure: Trace every host and give all traces to one ingest; ros2 run tracetools status must say
--     that tracing is enabled, in the environment of every node.
-- grain: one row per topic
-- severity: warning
-- needs: main.stat_orphan, main.subscription
SELECT
    o.run_id,
    coalesce(s.topic_name, 'unknown topic') AS subject,
    count(*) AS count,
    printf('%d messages', count(*)) AS detail
FROM main.stat_orphan AS o
LEFT JOIN main.subscription AS s ON o.subscription_id = s.subscription_id
WHERE o.reason = 'publisher_not_traced' AND NOT coalesce(s.is_internal, false)
GROUP BY o.run_id, s.topic_name
