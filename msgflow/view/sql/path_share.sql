-- description: The distribution of the latency of a path: latencies that occurred, such that a
--     share of the flows took no longer.
-- grain: one row per share
-- reads: flow
-- param: path BIGINT  Number of the path
-- param: steps BIGINT {1..2000} = 200  Number of shares
-- param: begin_at BIGINT = NULL  Only flows that began at this time or later, ns since origin
-- param: end_at BIGINT = NULL  Only flows that began before this time, ns since origin
-- column: share DOUBLE  Share of the flows, 0 to 1
-- column: latency BIGINT [ns]  Latency that they did not exceed
WITH ranked AS (
    SELECT
        latency,
        row_number() OVER (ORDER BY latency) AS position,
        count(*) OVER () AS number
    FROM flow
    WHERE run_id = $run
        AND path_id = $path
        AND latency IS NOT NULL
        AND ($begin_at IS NULL OR root_at >= $begin_at)
        AND ($end_at IS NULL OR root_at < $end_at)
)
SELECT max(position) / any_value(number)::DOUBLE AS share, max(latency) AS latency
FROM ranked
GROUP BY (position * $steps - 1) // number
ORDER BY share
