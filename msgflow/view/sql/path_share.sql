-- description: The distribution of the latency of a path: latencies that occurred, such that a
--     share of the flows took no longer.
-- grain: one row per share
-- param: path
-- param: steps BIGINT {1..2000} = 200  Number of shares
-- param: begin_at, end_at
-- column: share DOUBLE  Share of the flows, 0 to 1
-- column: latency BIGINT [ns]  Latency that they did not exceed
WITH ranked AS (
    SELECT
        latency,
        row_number() OVER (ORDER BY latency) AS position,
        count(*) OVER () AS number
    FROM chosen_flow
    WHERE latency IS NOT NULL
)
SELECT
    max(position) / any_value(number)::DOUBLE AS share,
    max(latency) AS latency
FROM ranked
GROUP BY (position * $steps - 1) // number
ORDER BY share
