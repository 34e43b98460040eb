-- description: Messages of a topic by pieces of time: how many were published and taken, how long
--     the takes took from publication to take, and the slowest of them.
-- grain: one row per piece of time with a publication or a take
-- param: topic, bins
-- column: start_at, length
-- column: published BIGINT  Publications in it
-- column: taken BIGINT  Takes in it
-- column: median BIGINT [ns]  Median latency of its takes; NULL: of none it is known
-- column: latency BIGINT [ns]  Longest latency of its takes
-- column: take_id BIGINT  Take with the longest latency
WITH happened AS (
    SELECT
        b.start_ns AS at_ns,
        false AS is_take,
        NULL::BIGINT AS take_id,
        NULL::BIGINT AS latency
    FROM main.publication AS b
    JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
    WHERE b.run_id = $run AND p.topic_name IS NOT DISTINCT FROM $topic
    UNION ALL
    SELECT t.taken_ns, true, t.take_id, l.latency_ns
    FROM main.take AS t
    JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
    LEFT JOIN main.link_transport AS l ON t.take_id = l.take_id
    WHERE t.run_id = $run
        AND s.topic_name IS NOT DISTINCT FROM $topic
        AND t.method <> 'callback_only'
)
SELECT
    $start_ns - $origin_ns + (h.at_ns - $start_ns) // e.width * e.width AS start_at,
    e.width AS length,
    count(*) FILTER (WHERE NOT h.is_take) AS published,
    count(*) FILTER (WHERE h.is_take) AS taken,
    quantile_disc(h.latency, 0.5) AS median,
    max(h.latency) AS latency,
    arg_max(h.take_id, (h.latency, -h.take_id)) FILTER (WHERE h.latency IS NOT NULL) AS take_id
FROM happened AS h
CROSS JOIN extent AS e
WHERE h.at_ns >= $start_ns AND h.at_ns < $end_ns
GROUP BY ALL
ORDER BY start_at
