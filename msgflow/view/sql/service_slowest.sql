-- description: The calls of one client of a service with the longest round trip.
-- grain: one row per request
-- param: client, limit
-- column: start_at BIGINT [ns since origin]  When the request was sent
-- column: duration BIGINT [ns]  Round trip
-- column: request_id BIGINT  Identity of the request
SELECT
    at_ns - $origin_ns AS start_at,
    round_trip AS duration,
    request_id
FROM client_call
WHERE at_ns >= $start_ns AND at_ns < $end_ns AND round_trip IS NOT NULL
ORDER BY duration DESC, request_id
LIMIT $limit
