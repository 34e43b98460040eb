-- title: Runs that stand out, by path
-- description: Runs whose median is further from that of the others than five times what is usual
--     (the median of the distances, scaled to a standard deviation) and than a twentieth of it.
--     Paths with fewer than five runs have no row: what is usual is not known.
-- grain: one row per path and run that stands out
-- column: path, run
-- column: median_ns BIGINT [ns]      Median latency of the run
-- column: usual_ns BIGINT [ns]       Median of the medians of all runs
-- column: change_percent DOUBLE [%]  Difference of the two
WITH middle AS (
    SELECT path, quantile_cont(median_ns, 0.5) AS usual, count(median_ns) AS runs
    FROM page_point
    GROUP BY path
),
spread AS (
    SELECT
        p.path,
        any_value(m.usual) AS usual,
        1.4826 * quantile_cont(abs(p.median_ns - m.usual), 0.5) AS deviation
    FROM page_point AS p
    JOIN middle AS m ON p.path = m.path
    WHERE m.runs >= 5
    GROUP BY p.path
)
SELECT
    p.path, p.run, p.median_ns,
    round(s.usual)::BIGINT AS usual_ns,
    100 * (p.median_ns - s.usual) / nullif(s.usual, 0) AS change_percent
FROM page_point AS p
JOIN spread AS s ON p.path = s.path
WHERE abs(p.median_ns - s.usual) > greatest(5 * s.deviation, abs(s.usual) / 20)
ORDER BY p.path, abs(p.median_ns - s.usual) DESC, p.run
