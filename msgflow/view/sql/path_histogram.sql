-- description: How many flows of a path took how long, in bins of one width.
-- grain: one row per bin with flows
-- reads: flow
-- param: path BIGINT  Number of the path
-- param: bins BIGINT {1..2000} = 60  Number of bins
-- param: begin_at BIGINT = NULL  Only flows that began at this time or later, ns since origin
-- param: end_at BIGINT = NULL  Only flows that began before this time, ns since origin
-- column: bin BIGINT  Position of the bin, from 0
-- column: low BIGINT [ns]  Least latency of the bin
-- column: width BIGINT [ns]  Width of the bins
-- column: count BIGINT  Flows
WITH reached AS (
    SELECT latency
    FROM flow
    WHERE run_id = $run
        AND path_id = $path
        AND latency IS NOT NULL
        AND ($begin_at IS NULL OR root_at >= $begin_at)
        AND ($end_at IS NULL OR root_at < $end_at)
),
extent AS (
    SELECT min(latency) AS least, (max(latency) - min(latency)) // $bins + 1 AS width FROM reached
)
SELECT
    (r.latency - e.least) // e.width AS bin,
    e.least + e.width * ((r.latency - e.least) // e.width) AS low,
    e.width,
    count(*) AS count
FROM reached AS r
CROSS JOIN extent AS e
GROUP BY ALL
ORDER BY bin
