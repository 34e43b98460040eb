-- description: The moment of each step, to the value: of the values two windows around it, the
--     split with most of them on their side of the middle between before and after.
-- grain: one row per step
-- param: steps VARCHAR  Name of a table with the rows of main.value_step
-- param: series_values, settled
-- column: run_id
-- column: what VARCHAR  As in main.series_value
-- column: series_id
-- column: number
-- column: at_ns BIGINT [epoch ns]  The first value behind it
-- column: before, after
-- column: score
CREATE OR REPLACE MACRO main.value_step_exact(steps, series_values, settled) AS TABLE
WITH near AS (
    SELECT
        c.what, c.series_id, c.number, v.at_ns,
        sum(
            CASE WHEN c.after > c.before THEN 1 ELSE -1 END
            * sign(v.value - (c.before + c.after) / 2)
        )
            OVER (
                PARTITION BY c.what, c.series_id, c.number
                ORDER BY v.at_ns
                ROWS BETWEEN CURRENT ROW AND UNBOUNDED FOLLOWING
            ) AS behind
    FROM query_table(steps) AS c
    JOIN query_table(settled) AS s ON c.run_id = s.run_id
    JOIN query_table(series_values) AS v
        ON c.what = v.what
        AND c.series_id = v.series_id
        AND abs(v.at_ns - c.at_ns) < (s.end_ns - s.start_ns) // 64
)
SELECT
    c.run_id, c.what, c.series_id, c.number,
    arg_max(n.at_ns, (n.behind, -n.at_ns)) AS at_ns,
    any_value(c.before) AS before,
    any_value(c.after) AS after,
    any_value(c.score) AS score
FROM query_table(steps) AS c
JOIN near AS n ON c.what = n.what AND c.series_id = n.series_id AND c.number = n.number
GROUP BY c.run_id, c.what, c.series_id, c.number
