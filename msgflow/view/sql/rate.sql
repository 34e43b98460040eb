-- description: Publications, takes and callbacks that began, by pieces of time: the curve on which
--     a window of time is chosen.
-- grain: one row per piece of time in which something began
-- param: bins BIGINT {1..2000} = 300  Number of pieces
-- column: start_at, length
-- column: count BIGINT  What began in it
WITH began AS (
    SELECT start_ns AS at_ns FROM main.publication WHERE run_id = $run
    UNION ALL
    SELECT taken_ns FROM main.take WHERE run_id = $run
    UNION ALL
    SELECT start_ns FROM main.callback_instance WHERE run_id = $run
)
SELECT
    $start_ns - $origin_ns + (b.at_ns - $start_ns) // e.width * e.width AS start_at,
    e.width AS length,
    count(*) AS count
FROM began AS b
CROSS JOIN extent AS e
WHERE b.at_ns >= $start_ns AND b.at_ns < $end_ns
GROUP BY ALL
ORDER BY start_at
