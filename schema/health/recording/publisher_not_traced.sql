-- title: Messages come from a publisher that is not traced, or events are missing
-- description: Messages were taken whose publication is not in the traces, although the known
--     publishers have no gap at that time. Their flows begin at the take.
-- cause: A node on another host or in another container is not part of the recording, or runs with
--     a tracetools without LTTng, or with TRACETOOLS_RUNTIME_DISABLE=1 (Lyrical); or events or
--     files of a publisher are missing and the trace does not say so.
-- cure: Trace every host and give all traces to one ingest. In the environment of every node, ros2
--     run tracetools status must say that tracing is enabled.
-- grain: one row per topic
-- severity: warning
-- when: store.orphan_take WHERE reason = 'publisher_not_traced'
SELECT
    o.run_id, s.topic_name,
    coalesce(s.topic_name, 'unknown topic') AS subject,
    count(*) AS count,
    derive.counted(count(*), 'message') AS detail
FROM main.stat_orphan AS o
LEFT JOIN main.subscription AS s ON o.subscription_id = s.subscription_id
WHERE o.reason = 'publisher_not_traced' AND NOT coalesce(s.is_internal, false)
GROUP BY o.run_id, s.topic_name
