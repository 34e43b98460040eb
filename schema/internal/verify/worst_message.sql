-- description: Of the messages that a subscription took in the window, the one that was longest on
--     its way.
-- grain: one row, or none
-- param: key BIGINT  Subscription that took it
SELECT
    l.latency_ns AS duration_ns,
    t.taken_ns AS at_ns,
    t.take_id AS id,
    'take' AS kind
FROM main.link_transport AS l
JOIN main.take AS t ON l.take_id = t.take_id
WHERE t.subscription_id = $key AND t.taken_ns >= $start_ns AND t.taken_ns < $end_ns
ORDER BY duration_ns DESC, t.taken_ns, t.take_id
LIMIT 1
