-- description: How fast the difference of two clocks changes: the median of the slopes between
--     stretches of time nearby (Theil-Sen), so that neither jumps nor single wrong differences
--     count. Only differences of the same place are compared: those of two places may differ by a
--     constant. Slopes too steep for any clock come from jumps, and are left out.
-- grain: one row per clock and stretch
-- param: course VARCHAR  Name of rows of clock_id, place, stretch, at_ns, offset_ns
CREATE OR REPLACE MACRO derive.clock_drift(course) AS TABLE
WITH slope AS (
    SELECT
        a.clock_id,
        a.stretch AS first_stretch,
        b.stretch AS last_stretch,
        (b.offset_ns - a.offset_ns) * 1e9 / (b.at_ns - a.at_ns) AS drift_ppb
    FROM query_table(course) AS a
    JOIN query_table(course) AS b
        ON a.clock_id = b.clock_id
        AND a.place = b.place
        AND b.stretch > a.stretch
        AND b.stretch <= a.stretch + 2 * derive.clock_limit().steady_stretches
)
SELECT
    t.clock_id, t.stretch,
    coalesce(median(s.drift_ppb), 0) AS drift_ppb
FROM (SELECT DISTINCT clock_id, stretch FROM query_table(course)) AS t
LEFT JOIN slope AS s
    ON t.clock_id = s.clock_id
    AND s.first_stretch >= t.stretch - derive.clock_limit().steady_stretches
    AND s.last_stretch <= t.stretch + derive.clock_limit().steady_stretches
    AND abs(s.drift_ppb) <= derive.clock_limit().drift_ppb
GROUP BY t.clock_id, t.stretch
