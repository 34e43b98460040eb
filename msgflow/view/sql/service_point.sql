-- description: Calls of one client of a service by pieces of time, with the longest of each.
-- grain: one row per piece of time in which a call began
-- param: client, bins
-- column: start_at, length
-- column: count BIGINT  Calls that began in it
-- column: answered BIGINT  Of these, those with a round trip
-- column: median BIGINT [ns]  Median round trip
-- column: duration BIGINT [ns]  Longest round trip
-- column: request_id BIGINT  Request with the longest round trip; without an answer, the first request
SELECT
    $start_ns - $origin_ns + (c.at_ns - $start_ns) // e.width * e.width AS start_at,
    e.width AS length,
    count(*) AS count,
    count(c.round_trip) AS answered,
    quantile_disc(c.round_trip, 0.5) AS median,
    max(c.round_trip) AS duration,
    arg_max(c.request_id, (coalesce(c.round_trip, -1), -c.request_id)) AS request_id
FROM client_call AS c
CROSS JOIN extent AS e
WHERE c.at_ns >= $start_ns AND c.at_ns < $end_ns
GROUP BY ALL
ORDER BY start_at
