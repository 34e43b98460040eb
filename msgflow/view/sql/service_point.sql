-- description: Calls of one client of a service by pieces of time, with the longest of each.
-- grain: one row per piece of time in which a call began
-- param: client, bins
-- column: start_at, length
-- column: count BIGINT  Calls that began in it
-- column: answered BIGINT  Of these, those with a round trip
-- column: median BIGINT [ns]  Median round trip
-- column: duration BIGINT [ns]  Longest round trip
-- column: request_id BIGINT  Request with the longest round trip; without an answer, the first request
WITH extent AS (SELECT ($end_ns - $start_ns) // $bins + 1 AS width),
call AS (
    SELECT
        q.request_id,
        coalesce(q.sent_ns, q.taken_ns) AS at_ns,
        min(r.taken_ns) - q.sent_ns AS round_trip
    FROM main.request AS q
    LEFT JOIN main.response AS r ON q.request_id = r.request_id
    WHERE q.run_id = $run AND q.client_id IS NOT DISTINCT FROM $client
    GROUP BY q.request_id, q.sent_ns, q.taken_ns
)
SELECT
    $start_ns - $origin_ns + (c.at_ns - $start_ns) // e.width * e.width AS start_at,
    e.width AS length,
    count(*) AS count,
    count(c.round_trip) AS answered,
    quantile_disc(c.round_trip, 0.5) AS median,
    max(c.round_trip) AS duration,
    arg_max(c.request_id, (coalesce(c.round_trip, -1), -c.request_id)) AS request_id
FROM call AS c
CROSS JOIN extent AS e
WHERE c.at_ns >= $start_ns AND c.at_ns < $end_ns
GROUP BY ALL
ORDER BY start_at
