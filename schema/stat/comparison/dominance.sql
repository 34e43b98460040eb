-- name: derive.dominance
-- kind: macro
-- description: How often values of side b exceed those of side a, minus how often it is the other
--     way round (Cliff's delta), by rank sums with ties in the middle. `valued` is the name of a
--     table with side, subject and value_ns.
-- grain: one row per subject that both sides have values of
CREATE OR REPLACE MACRO derive.dominance(valued) AS TABLE
WITH ranked AS (
    SELECT
        subject,
        side,
        rank() OVER (PARTITION BY subject ORDER BY value_ns)
        + (count(*) OVER (PARTITION BY subject, value_ns) - 1) / 2 AS value_rank
    FROM query_table(valued)
    WHERE value_ns IS NOT NULL
)
SELECT
    subject,
    2 * (
        sum(value_rank) FILTER (WHERE side = 'b')
        - count(*) FILTER (WHERE side = 'b') * (count(*) FILTER (WHERE side = 'b') + 1) / 2
    ) / (
        count(*) FILTER (WHERE side = 'a') * count(*) FILTER (WHERE side = 'b')
    ) - 1 AS cliffs_delta
FROM ranked
GROUP BY subject
HAVING count(DISTINCT side) = 2
