-- description: Values that grow or fall all through a run: the median of the slopes between any two
--     of 16 parts (Theil and Sen), where five of six pairs go the same way, the parts lie closer to
--     the line than to any two levels, and the ends of the line differ by a third or more.
-- grain: one row per series with a trend
-- param: windows
-- column: run_id
-- column: what VARCHAR  As in main.series_value
-- column: series_id
-- column: at_ns BIGINT [epoch ns]  Where the line begins: the middle of the first part
-- column: before DOUBLE  The line at its begin
-- column: after DOUBLE  And at its end
-- column: certainty DOUBLE  By how much more pairs of windows go its way than the other, as a share
-- column: slopes DOUBLE[]  Of pairs of windows, per ns: with 90 % at least, the median, at most
CREATE OR REPLACE MACRO main.value_trend(windows) AS TABLE
WITH coarse AS (
    SELECT
        run_id, what, series_id,
        median(value) AS value,
        median(at_ns) AS at_ns
    FROM (
        SELECT
            *,
            ntile(16) OVER (PARTITION BY what, series_id ORDER BY number) AS part
        FROM query_table(windows)
        WHERE what NOT IN ('timer', 'topic', 'take')
    )
    GROUP BY run_id, what, series_id, part
),
slope AS (
    SELECT
        a.what, a.series_id,
        min(a.at_ns)::BIGINT AS at_ns,
        quantile_cont((b.value - a.value) / (b.at_ns - a.at_ns), [0.05, 0.5, 0.95]) AS slopes,
        avg(sign(b.value - a.value)) AS direction
    FROM coarse AS a
    JOIN coarse AS b ON a.what = b.what AND a.series_id = b.series_id AND a.at_ns < b.at_ns
    GROUP BY a.what, a.series_id
    HAVING abs(direction) > 2 / 3
),
line AS (
    SELECT
        c.run_id, c.what, c.series_id, s.at_ns, s.slopes, s.direction,
        max(c.at_ns) AS until_ns,
        median(c.value - s.slopes[2] * (c.at_ns - s.at_ns)) AS base
    FROM coarse AS c
    JOIN slope AS s ON c.what = s.what AND c.series_id = s.series_id
    GROUP BY c.run_id, c.what, c.series_id, s.at_ns, s.slopes, s.direction
),
-- What one step in place of the line leaves: squares of the distances from two levels.
step AS (
    SELECT
        what, series_id,
        var_pop(value) OVER before * count(*) OVER before
        + var_pop(value) OVER behind * count(*) OVER behind AS error
    FROM coarse
    WINDOW
        before AS (PARTITION BY what, series_id ORDER BY at_ns ROWS UNBOUNDED PRECEDING),
        behind AS (
            PARTITION BY what, series_id
            ORDER BY at_ns
            ROWS BETWEEN 1 FOLLOWING AND UNBOUNDED FOLLOWING
        )
),
best_step AS (
    SELECT
        what, series_id,
        min(error) AS error
    FROM step
    GROUP BY what, series_id
)
SELECT
    l.run_id, l.what, l.series_id, l.at_ns,
    l.base AS before,
    l.base + l.slopes[2] * (l.until_ns - l.at_ns) AS after,
    abs(l.direction) AS certainty,
    l.slopes
FROM line AS l
JOIN coarse AS c ON l.what = c.what AND l.series_id = c.series_id
JOIN best_step AS s ON l.what = s.what AND l.series_id = s.series_id
WHERE abs(after - l.base) > main.least_change(l.what)
    AND after >= 0
    AND greatest(l.base, after) > 1.3 * least(l.base, after)
GROUP BY ALL
HAVING sum((c.value - l.base - l.slopes[2] * (c.at_ns - l.at_ns)) ** 2) < any_value(s.error)
