-- name: internal.series_topic
-- title: Latency of topics over time
-- description: Latency from publication to take, by the take. Subscriptions of one name have their
--     identity behind it.
-- grain: one row per take with a publication, but of stored messages
-- param: runs BIGINT[]  Runs
-- param: start_ns BIGINT  Begin of the window, epoch ns
-- param: end_ns BIGINT  End of the window, epoch ns
-- column: at_ns BIGINT [epoch ns]  The take
-- column: subject VARCHAR  Topic and node of the subscription
-- column: value_ns BIGINT [ns]  Latency
SELECT t.taken_ns AS at_ns, coalesce(s.topic_name, '?') || ' → ' || coalesce(n.full_name, '?')
    || CASE WHEN min(t.subscription_id) OVER (PARTITION BY s.topic_name, n.full_name)
        <> max(t.subscription_id) OVER (PARTITION BY s.topic_name, n.full_name)
    THEN ' #' || t.subscription_id ELSE '' END AS subject,
    l.latency_ns AS value_ns
FROM main.take AS t
JOIN main.link_transport AS l ON t.take_id = l.take_id
JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
LEFT JOIN main.node AS n ON s.node_id = n.node_id
WHERE list_contains($runs, t.run_id) AND t.taken_ns >= $start_ns AND t.taken_ns < $end_ns
    AND l.latency_ns IS NOT NULL AND NOT coalesce(s.is_internal, false)
ORDER BY at_ns, subject, value_ns
