-- description: What `msgflow query topics --measure unmatched` lists one by one, counted by topic,
--     receiving node and reason.
-- grain: one row per topic, receiving node, status and reason
-- column: topic
-- column: subscriber VARCHAR  Node that should have taken, or took
-- column: status VARCHAR  'dropped', 'lost', 'not_connected', 'cut_by_recording',
--     'unknown' or 'orphan' (a take without a publication)
-- column: reason
-- column: count BIGINT  Messages, or takes
-- column: first_at BIGINT [ns since origin]  The first of them
-- column: last_at BIGINT [ns since origin]  The last of them
-- column: kind VARCHAR  What the first one is: 'publication' or 'take'
-- column: id BIGINT  Identity of the first one
-- column: is_internal
SELECT
    s.topic_name AS topic,
    main.node_label(n.full_name, p.name, p.pid) AS subscriber,
    m.status, m.reason,
    count(*) AS count,
    min(m.at_ns) - $origin_ns AS first_at,
    max(m.at_ns) - $origin_ns AS last_at,
    m.kind,
    arg_min(m.id, (m.at_ns, m.id)) AS id,
    bool_or(coalesce(s.is_internal, false)) AS is_internal
FROM missing_side AS m
LEFT JOIN main.subscription AS s ON m.subscription_id = s.subscription_id
LEFT JOIN main.node AS n ON s.node_id = n.node_id
LEFT JOIN main.process AS p ON m.process_id = p.process_id
WHERE m.run_id = $run AND m.at_ns >= $start_ns AND m.at_ns < $end_ns
GROUP BY ALL
ORDER BY count DESC, topic, subscriber, m.status, m.reason, id
