-- description: Pairs of a message and a publication that may be its own, without those that the
--     course of the clock rules out: no drift brings them near the difference of their stretch of
--     time.
-- grain: one row per pair
-- param: pairs VARCHAR  Name of rows as of derive.stamp_pair
-- param: course VARCHAR  Name of rows of clock_id, stretch, stretch_ns, offset_ns
CREATE OR REPLACE MACRO derive.close_pair(pairs, course) AS TABLE
SELECT p.clock_id, p.stretch, p.written_ns, p.least_ns, p.greatest_ns
FROM (
    SELECT
        clock_id, stretch, offset_ns,
        stretch_ns::DOUBLE * derive.clock_limit().drift_ppb / 1e9 AS wander_ns
    FROM query_table(course)
) AS c
JOIN query_table(pairs) AS p
    ON c.clock_id = p.clock_id
    AND c.stretch = p.stretch
    AND p.greatest_ns >= c.offset_ns - c.wander_ns
    AND p.least_ns <= c.offset_ns + c.wander_ns
