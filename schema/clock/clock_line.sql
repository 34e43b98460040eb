-- description: The line that is chosen of all that are possible between two hulls: through the
--     middle between them where they are nearest to each other, and as steep as their longest edge.
--     With the lowest and the highest slope of a possible line. Where none is possible (`is_even`
--     is false), that which misses least. `corners` is the name of a table with the corners of
--     hulls as derive.clock_hull gives them, `edges` that of one with what lies between these and
--     beyond them.
-- grain: one row per pair of clocks with a hull on both sides
CREATE OR REPLACE MACRO derive.clock_line(corners, edges) AS TABLE
-- The hulls are nearest at a corner of one of them.
WITH distance AS (
    SELECT
        c.clock_id, c.other_clock_id, c.moment,
        -c.sense * c.bound AS own,
        c.sense * (e.bound + e.slope * (c.moment - e.moment)) AS opposite,
        CASE WHEN NOT e.is_beyond THEN c.sense * e.slope END AS slope,
        -c.bound - e.bound - e.slope * (c.moment - e.moment) AS distance
    FROM query_table(corners) AS c
    ASOF JOIN query_table(edges) AS e
        ON c.clock_id = e.clock_id
        AND c.other_clock_id = e.other_clock_id
        AND -c.sense = e.sense
        AND c.moment >= e.moment
),
nearest AS (
    SELECT clock_id, other_clock_id, moment, own, opposite, slope, distance
    FROM distance
    QUALIFY row_number() OVER (
        PARTITION BY clock_id, other_clock_id ORDER BY distance, slope IS NULL, moment
    ) = 1
),
-- A line is possible where it is so for each bound below together with each above.
steepness AS (
    SELECT
        l.clock_id, l.other_clock_id,
        greatest(
            -derive.clock_drift_limit(),
            max(CASE WHEN u.moment < l.moment THEN (-u.bound - l.bound) / (u.moment - l.moment) END)
        ) AS lowest,
        least(
            derive.clock_drift_limit(),
            min(CASE WHEN u.moment > l.moment THEN (-u.bound - l.bound) / (u.moment - l.moment) END)
        ) AS highest
    FROM query_table(corners) AS l
    JOIN query_table(corners) AS u
        ON l.clock_id = u.clock_id AND l.other_clock_id = u.other_clock_id
    WHERE l.sense < 0 AND u.sense > 0
    GROUP BY l.clock_id, l.other_clock_id
),
-- How steep a possible line through the middle can be, and what the longest edge says: those who
-- sent and received at both its ends were equally fast.
through AS (
    SELECT
        n.clock_id, n.other_clock_id, n.moment, n.distance, n.slope,
        (n.own + n.opposite) / 2 AS middle,
        max(
            CASE WHEN c.sense * (c.moment - n.moment) < 0
                THEN (-c.sense * c.bound - (n.own + n.opposite) / 2) / (c.moment - n.moment) END
        ) AS flattest,
        min(
            CASE WHEN c.sense * (c.moment - n.moment) > 0
                THEN (-c.sense * c.bound - (n.own + n.opposite) / 2) / (c.moment - n.moment) END
        ) AS steepest
    FROM nearest AS n
    JOIN query_table(corners) AS c
        ON n.clock_id = c.clock_id AND n.other_clock_id = c.other_clock_id
    GROUP BY ALL
),
longest AS (
    SELECT
        clock_id, other_clock_id,
        arg_max(-sense * slope, duration) AS slope
    FROM (
        SELECT
            clock_id, other_clock_id, sense, slope, is_beyond,
            lead(moment) OVER (
                PARTITION BY clock_id, other_clock_id, sense ORDER BY moment
            ) - moment AS duration
        FROM query_table(edges)
    )
    WHERE NOT is_beyond
    GROUP BY clock_id, other_clock_id
)
SELECT
    n.clock_id, n.other_clock_id, n.moment, n.distance,
    n.distance >= 0 AS is_even,
    s.lowest, s.highest,
    round(n.middle) AS middle,
    round(
        CASE
            WHEN n.distance < 0 THEN coalesce(n.slope, 0)
            ELSE greatest(
                s.lowest, n.flattest,
                least(
                    s.highest, n.steepest,
                    coalesce(
                        o.slope,
                        (greatest(s.lowest, n.flattest) + least(s.highest, n.steepest)) / 2
                    )
                )
            )
        END * 1e9
    ) AS drift_ppb
FROM through AS n
JOIN steepness AS s ON n.clock_id = s.clock_id AND n.other_clock_id = s.other_clock_id
LEFT JOIN longest AS o ON n.clock_id = o.clock_id AND n.other_clock_id = o.other_clock_id
