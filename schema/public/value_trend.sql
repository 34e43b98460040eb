-- description: Values that grow or fall all through a run: the median of the slopes between any two
--     windows (Theil and Sen), where three of four pairs go the same way, the windows lie much
--     closer to the line than to one level, and the ends of the line differ by a third or more.
-- grain: one row per series with a trend
-- param: windows
-- column: run_id
-- column: what VARCHAR  As in main.series_value
-- column: series_id
-- column: at_ns BIGINT [epoch ns]  Where the line begins
-- column: before DOUBLE  The line at its begin
-- column: after DOUBLE  And at its end
-- column: certainty DOUBLE  By how much more pairs of windows go its way than the other, as a share
-- column: slopes DOUBLE[]  Of pairs of windows, per ns: with 90 % at least, the median, at most
CREATE OR REPLACE MACRO main.value_trend(windows) AS TABLE
WITH coarse AS (
    SELECT
        run_id, what, series_id,
        median(value) AS value,
        min(at_ns) AS at_ns
    FROM query_table(windows)
    WHERE what NOT IN ('timer', 'topic', 'loss')
    GROUP BY run_id, what, series_id, number // 4
),
slope AS (
    SELECT
        a.what, a.series_id,
        min(a.at_ns) AS at_ns,
        quantile_cont((b.value - a.value) / (b.at_ns - a.at_ns), [0.05, 0.5, 0.95]) AS slopes,
        avg(sign(b.value - a.value)) AS direction
    FROM coarse AS a
    JOIN coarse AS b ON a.what = b.what AND a.series_id = b.series_id AND a.at_ns < b.at_ns
    GROUP BY a.what, a.series_id
    HAVING count(*) >= 45 AND abs(direction) > 0.75
),
line AS (
    SELECT
        c.run_id, c.what, c.series_id, s.at_ns, s.slopes, s.direction,
        median(c.value) AS level,
        max(c.at_ns) AS until_ns,
        median(c.value - s.slopes[2] * (c.at_ns - s.at_ns)) AS base
    FROM coarse AS c
    JOIN slope AS s ON c.what = s.what AND c.series_id = s.series_id
    GROUP BY c.run_id, c.what, c.series_id, s.at_ns, s.slopes, s.direction
)
SELECT
    l.run_id, l.what, l.series_id, l.at_ns,
    l.base AS before,
    l.base + l.slopes[2] * (l.until_ns - l.at_ns) AS after,
    abs(l.direction) AS certainty,
    l.slopes
FROM line AS l
JOIN coarse AS c ON l.what = c.what AND l.series_id = c.series_id
WHERE abs(after - l.base) > 1_000_000 AND greatest(l.base / after, after / l.base) > 1.3
GROUP BY ALL
HAVING median(abs(c.value - l.base - l.slopes[2] * (c.at_ns - l.at_ns)))
    < 0.3 * median(abs(c.value - l.level))
