-- description: Systems that warm up: their longest values lie at the start. `parts` is the name of
--     a table with a row per value: side, subject, how many values these have, the place of the
--     value among them, when it was, and the value.
-- grain: one row per side and subject with three values of the first quarter that exceed all later
--     ones
CREATE OR REPLACE MACRO derive.warm_up(parts) AS TABLE
SELECT
    side, subject,
    max(at_ns) AS last_ns
FROM (
    SELECT
        side, subject, number, position, at_ns, value_ns,
        max(value_ns) FILTER (WHERE 4 * position >= number)
            OVER (PARTITION BY side, subject) AS later_ns
    FROM query_table(parts)
)
WHERE 4 * position < number AND value_ns > later_ns
GROUP BY side, subject
-- By chance, three values are the longest and all of the first quarter in 1 of 64 cases.
HAVING count(*) >= 3
