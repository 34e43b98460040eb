-- description: How fast the difference of two clocks changes: the median of the slopes between
--     stretches of time (Theil-Sen), so that single wrong differences do not count. Slopes over
--     less than a third of the time are mostly of chance.
-- grain: one row per clock and segment
-- param: course VARCHAR  Name of rows of clock_id, segment, at_ns, difference_ns
CREATE OR REPLACE MACRO derive.clock_drift(course) AS TABLE
WITH piece AS (
    SELECT
        clock_id, segment,
        min(at_ns) AS start_ns,
        max(at_ns) AS end_ns
    FROM query_table(course)
    GROUP BY clock_id, segment
)
SELECT
    p.clock_id, p.segment,
    (p.start_ns + p.end_ns) // 2 AS middle_ns,
    coalesce(
        median((b.difference_ns - a.difference_ns) * 1e9 / (b.at_ns - a.at_ns)), 0
    )::BIGINT AS drift_ppb
FROM piece AS p
LEFT JOIN query_table(course) AS a ON p.clock_id = a.clock_id AND p.segment = a.segment
LEFT JOIN query_table(course) AS b
    ON p.clock_id = b.clock_id
    AND p.segment = b.segment
    AND b.at_ns > a.at_ns
    AND 3 * (b.at_ns - a.at_ns) >= p.end_ns - p.start_ns
GROUP BY p.clock_id, p.segment, p.start_ns, p.end_ns
