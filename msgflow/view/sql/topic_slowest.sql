-- description: The takes of a topic with the longest latency from publication to take.
-- grain: one row per take
-- param: topic, limit
-- column: taken_at BIGINT [ns since origin]  When it was taken
-- column: subscriber VARCHAR  Node that took it
-- column: latency BIGINT [ns]  From the end of the publication to the take
-- column: take_id BIGINT  Identity of the take
SELECT
    t.taken_ns - $origin_ns AS taken_at,
    main.node_label(n.full_name, p.name, p.pid) AS subscriber,
    l.latency_ns AS latency,
    t.take_id
FROM main.take AS t
JOIN main.link_transport AS l ON t.take_id = l.take_id
JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
JOIN main.process AS p ON s.process_id = p.process_id
LEFT JOIN main.node AS n ON s.node_id = n.node_id
WHERE t.run_id = $run
    AND s.topic_name IS NOT DISTINCT FROM $topic
    AND t.method <> 'callback_only'
    AND t.taken_ns >= $start_ns
    AND t.taken_ns < $end_ns
    AND l.latency_ns IS NOT NULL
ORDER BY l.latency_ns DESC, t.take_id
LIMIT $limit
