-- description: Of the answered requests of a client to a service in the window, the one that was
--     answered latest.
-- grain: one row, or none
-- param: key BIGINT[]  Service and client
SELECT
    p.taken_ns - q.sent_ns AS duration_ns,
    q.sent_ns AS at_ns,
    q.request_id AS id,
    'request' AS kind
FROM main.request AS q
JOIN main.response AS p ON q.request_id = p.request_id
WHERE [q.service_id, q.client_id] = $key AND q.sent_ns >= $start_ns AND q.sent_ns < $end_ns
    AND p.taken_ns IS NOT NULL
ORDER BY duration_ns DESC, q.sent_ns, q.request_id
LIMIT 1
