-- description: The calls of one client of a service with the longest round trip.
-- grain: one row per request
-- param: client, limit
-- column: start_at BIGINT [ns since origin]  When the request was sent
-- column: duration BIGINT [ns]  Round trip
-- column: request_id BIGINT  Identity of the request
SELECT q.sent_ns - $origin_ns AS start_at, min(r.taken_ns) - q.sent_ns AS duration, q.request_id
FROM main.request AS q
JOIN main.response AS r ON q.request_id = r.request_id
WHERE q.run_id = $run
    AND q.client_id IS NOT DISTINCT FROM $client
    AND q.sent_ns >= $start_ns
    AND q.sent_ns < $end_ns
    AND r.taken_ns IS NOT NULL
GROUP BY q.request_id, q.sent_ns
ORDER BY duration DESC, q.request_id
LIMIT $limit
