-- description: How many flows of a path took how long, in bins of one width.
-- grain: one row per bin with flows
-- param: path
-- param: bins BIGINT {1..2000} = 60  Number of bins
-- param: begin_at, end_at
-- column: bin BIGINT  Position of the bin, from 0
-- column: low BIGINT [ns]  Least latency of the bin
-- column: width BIGINT [ns]  Width of the bins
-- column: count BIGINT  Flows
WITH reached AS (
    SELECT
        latency,
        min(latency) OVER () AS least,
        (max(latency) OVER () - min(latency) OVER ()) // $bins + 1 AS width
    FROM chosen_flow
    WHERE latency IS NOT NULL
)
SELECT
    (latency - least) // width AS bin,
    least + width * bin AS low,
    width,
    count(*) AS count
FROM reached
GROUP BY ALL
ORDER BY bin
