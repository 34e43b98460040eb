-- description: What `msgflow query topics --measure unmatched` lists one by one, counted by pieces
--     of time, topic and reason.
-- grain: one row per piece of time, topic and reason
-- param: bins BIGINT {1..2000} = 100  Number of pieces
-- column: start_at, length, topic
-- column: status VARCHAR  As in loss
-- column: reason
-- column: count BIGINT  Messages, or takes
-- column: is_internal
SELECT
    $start_ns - $origin_ns + (m.at_ns - $start_ns) // e.width * e.width AS start_at,
    e.width AS length,
    s.topic_name AS topic,
    m.status, m.reason,
    count(*) AS count,
    coalesce(s.is_internal, false) AS is_internal
FROM missing_side AS m
CROSS JOIN extent AS e
LEFT JOIN main.subscription AS s ON m.subscription_id = s.subscription_id
WHERE m.run_id = $run AND m.at_ns >= $start_ns AND m.at_ns < $end_ns
GROUP BY ALL
ORDER BY start_at, topic, m.status, m.reason, is_internal
