-- description: How far a possible line is at most from the chosen one: at some moments, with
--     straight lines in between. `edges` is the name of a table with the edges of hulls, `lines`
--     that of one as derive.clock_line gives it, `extents` that of one with the begin_moment and
--     end_moment for which it is asked.
-- grain: one row per pair of clocks with a possible line, and moment
CREATE OR REPLACE MACRO derive.clock_line_error(edges, lines, extents) AS TABLE
-- The hulls as far as possible lines can follow them: where a hull is steeper, the steepest line
-- counts.
WITH limited AS MATERIALIZED (
    SELECT
        c.clock_id, c.other_clock_id, c.sense, c.moment, c.bound,
        CASE WHEN c.sense < 0 THEN l.lowest ELSE -l.highest END AS flattest,
        CASE WHEN c.sense < 0 THEN l.highest ELSE -l.lowest END AS steepest
    FROM (
        SELECT
            clock_id, other_clock_id, sense, moment, bound, slope,
            lag(slope) OVER (
                PARTITION BY clock_id, other_clock_id, sense ORDER BY moment
            ) AS slope_before
        FROM query_table(edges)
    ) AS c
    JOIN query_table(lines) AS l ON c.clock_id = l.clock_id AND c.other_clock_id = l.other_clock_id
    WHERE l.is_even
        AND c.moment >= 0
        AND c.slope_before >= CASE WHEN c.sense < 0 THEN l.lowest ELSE -l.highest END
        AND c.slope <= CASE WHEN c.sense < 0 THEN l.highest ELSE -l.lowest END
),
limit_edge AS (
    SELECT
        clock_id, other_clock_id, sense, moment, bound,
        coalesce(
            (lead(bound) OVER along - bound) / (lead(moment) OVER along - moment), flattest
        ) AS slope
    FROM limited
    WINDOW along AS (PARTITION BY clock_id, other_clock_id, sense ORDER BY moment)
    UNION ALL
    SELECT
        c.clock_id, c.other_clock_id, c.sense,
        e.begin_moment - 1,
        arg_min(c.bound, c.moment)
        - any_value(c.steepest) * (min(c.moment) - e.begin_moment + 1),
        any_value(c.steepest)
    FROM limited AS c
    JOIN query_table(extents) AS e
        ON c.clock_id = e.clock_id AND c.other_clock_id = e.other_clock_id
    GROUP BY c.clock_id, c.other_clock_id, c.sense, e.begin_moment
),
knot AS (
    SELECT clock_id, other_clock_id, moment FROM limited
    UNION
    SELECT clock_id, other_clock_id, moment FROM query_table(lines)
    UNION
    SELECT clock_id, other_clock_id, begin_moment FROM query_table(extents)
    UNION
    SELECT clock_id, other_clock_id, end_moment FROM query_table(extents)
),
-- How far the lowest and the highest possible line are from the one chosen.
apart AS (
    SELECT
        k.clock_id, k.other_clock_id, k.moment,
        max(
            CASE WHEN e.sense < 0 THEN l.middle + l.drift_ppb / 1e9 * (k.moment - l.moment)
                - e.bound - e.slope * (k.moment - e.moment) END
        ) AS below,
        max(
            CASE WHEN e.sense > 0 THEN -e.bound - e.slope * (k.moment - e.moment)
                - l.middle - l.drift_ppb / 1e9 * (k.moment - l.moment) END
        ) AS above
    FROM (SELECT * FROM knot CROSS JOIN (VALUES (-1), (1)) AS way (sense)) AS k
    JOIN query_table(lines) AS l ON k.clock_id = l.clock_id AND k.other_clock_id = l.other_clock_id
    ASOF JOIN limit_edge AS e
        ON k.clock_id = e.clock_id
        AND k.other_clock_id = e.other_clock_id
        AND k.sense = e.sense
        AND k.moment >= e.moment
    GROUP BY k.clock_id, k.other_clock_id, k.moment
)
-- The greater of the two has a corner where they are equal.
SELECT
    clock_id, other_clock_id, moment,
    greatest(below, above) AS error
FROM apart
UNION ALL
SELECT
    clock_id, other_clock_id,
    moment + share * (next_moment - moment),
    below + share * (next_below - below)
FROM (
    SELECT
        clock_id, other_clock_id, moment, below, next_moment, next_below,
        (above - below) / ((above - below) - (next_above - next_below)) AS share
    FROM (
        SELECT
            clock_id, other_clock_id, moment, below, above,
            lead(moment) OVER along AS next_moment,
            lead(below) OVER along AS next_below,
            lead(above) OVER along AS next_above
        FROM apart
        WINDOW along AS (PARTITION BY clock_id, other_clock_id ORDER BY moment)
    )
    WHERE (above > below) <> (next_above > next_below)
)
WHERE share > 0 AND share < 1
