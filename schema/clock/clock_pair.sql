-- name: derive.clock_pair
-- kind: macro
-- description: How the times of one clock become those of another, from the messages and packets
--     between them in both directions. Every line between the two hulls is possible that is no
--     steeper than clocks can drift apart. The hulls are nearest to each other at the shortest
--     round trip that was observed, once the drift is taken out. There, the middle between them
--     is the offset, and half the distance bounds its error. The drift is that of the possible
--     line through this middle that is parallel to the longest edge of the hulls; the steepest
--     and the flattest possible line bound its error (Duda 1987; Poirier, Roy and Dagenais 2010;
--     Jabbarifar and Dagenais 2014). `bounds` holds how far a possible line is at most from the
--     chosen one: at some moments, with straight lines in between. It grows where nothing passes
--     one way. Where no line is possible, the clocks do not run evenly, or drift apart faster
--     than clocks do. Then the line that misses least is given, and its error at any time is
--     bounded by the fastest message or packet of each stretch. Without any in one of the
--     directions, all is NULL.
-- grain: one row per pair of clocks with messages or packets between them
-- needs: derive.clock_bound, derive.clock_hull, derive.clock_drift_limit, store.trace, store.host
CREATE OR REPLACE MACRO derive.clock_pair(only_run) AS TABLE
WITH corner AS MATERIALIZED (
    SELECT
        clock_id, other_clock_id, sense, moment, bound, base_ns, base_bound_ns, received_count,
        sent_count, received_packet_count, sent_packet_count
    FROM derive.clock_hull(only_run)
),
pair AS MATERIALIZED (
    SELECT
        clock_id, other_clock_id, any_value(base_ns) AS base_ns,
        any_value(base_bound_ns) AS base_bound_ns,
        any_value(received_count) AS received_count,
        any_value(sent_count) AS sent_count,
        any_value(received_packet_count) AS received_packet_count,
        any_value(sent_packet_count) AS sent_packet_count,
        max(moment) AS last_moment
    FROM corner
    GROUP BY clock_id, other_clock_id
),
-- A hull goes on beyond its corners as steeply as clocks can drift apart.
edge AS MATERIALIZED (
    SELECT
        clock_id, other_clock_id, sense, moment, bound,
        coalesce(
            (lead(bound) OVER along - bound) / (lead(moment) OVER along - moment),
            -derive.clock_drift_limit()
        ) AS slope,
        lead(moment) OVER along IS NULL AS is_beyond
    FROM corner
    WINDOW along AS (PARTITION BY clock_id, other_clock_id, sense ORDER BY moment)
    UNION ALL
    SELECT
        clock_id, other_clock_id, sense, -1,
        arg_min(bound, moment) - derive.clock_drift_limit() * (min(moment) + 1),
        derive.clock_drift_limit(), true
    FROM corner
    GROUP BY clock_id, other_clock_id, sense
),
-- The hulls are nearest at a corner of one of them.
distance AS (
    SELECT
        c.clock_id, c.other_clock_id, c.moment,
        -c.sense * c.bound AS own,
        c.sense * (e.bound + e.slope * (c.moment - e.moment)) AS opposite,
        CASE WHEN NOT e.is_beyond THEN c.sense * e.slope END AS slope,
        -c.bound - e.bound - e.slope * (c.moment - e.moment) AS distance
    FROM corner AS c
    ASOF JOIN edge AS e
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
    FROM corner AS l
    JOIN corner AS u ON l.clock_id = u.clock_id AND l.other_clock_id = u.other_clock_id
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
    JOIN corner AS c ON n.clock_id = c.clock_id AND n.other_clock_id = c.other_clock_id
    GROUP BY ALL
),
longest AS (
    SELECT clock_id, other_clock_id, arg_max(-sense * slope, duration) AS slope
    FROM (
        SELECT
            clock_id, other_clock_id, sense, slope, is_beyond,
            lead(moment) OVER (
                PARTITION BY clock_id, other_clock_id, sense ORDER BY moment
            ) - moment AS duration
        FROM edge
    )
    WHERE NOT is_beyond
    GROUP BY clock_id, other_clock_id
),
line AS MATERIALIZED (
    SELECT
        n.clock_id, n.other_clock_id, n.moment, n.distance, n.distance >= 0 AS is_even,
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
                            (
                                greatest(s.lowest, n.flattest) + least(s.highest, n.steepest)
                            ) / 2
                        )
                    )
                )
            END * 1e9
        ) AS drift_ppb
    FROM through AS n
    JOIN steepness AS s ON n.clock_id = s.clock_id AND n.other_clock_id = s.other_clock_id
    LEFT JOIN longest AS o ON n.clock_id = o.clock_id AND n.other_clock_id = o.other_clock_id
),
-- How far the clocks can be from the line at any time, where no line is possible.
miss AS (
    SELECT clock_id, other_clock_id, ceil(max(abs(least_miss))) AS greatest_miss
    FROM (
        SELECT
            l.clock_id, l.other_clock_id,
            min(
                -b.bound_ns - b.sense * (
                    p.base_bound_ns + l.middle
                    + l.drift_ppb / 1e9 * (b.at_ns - p.base_ns - l.moment)
                )
            ) AS least_miss
        FROM line AS l
        JOIN pair AS p ON l.clock_id = p.clock_id AND l.other_clock_id = p.other_clock_id
        JOIN derive.clock_bound(only_run) AS b
            ON l.clock_id = b.clock_id AND l.other_clock_id = b.other_clock_id
        WHERE NOT l.is_even
        GROUP BY
            l.clock_id, l.other_clock_id, b.sense,
            (b.at_ns - p.base_ns) // (p.last_moment::BIGINT // 256 + 1)
    )
    GROUP BY clock_id, other_clock_id
),
recorded AS (
    SELECT h.clock_id, min(t.start_ns) AS begin_ns, max(t.end_ns) AS end_ns
    FROM store.host AS h
    JOIN store.trace AS t ON h.host_id = t.host_id
    WHERE h.run_id = only_run
    GROUP BY h.clock_id
),
-- From the first to the last moment at which either of the two was recorded.
extent AS MATERIALIZED (
    SELECT
        l.clock_id, l.other_clock_id,
        least(
            0, r.begin_ns - p.base_ns, o.begin_ns - p.base_ns - p.base_bound_ns - l.middle::BIGINT
        )::DOUBLE AS begin_moment,
        greatest(
            p.last_moment, r.end_ns - p.base_ns,
            o.end_ns - p.base_ns - p.base_bound_ns - l.middle::BIGINT
        )::DOUBLE AS end_moment
    FROM line AS l
    JOIN pair AS p ON l.clock_id = p.clock_id AND l.other_clock_id = p.other_clock_id
    LEFT JOIN recorded AS r ON l.clock_id = r.clock_id
    LEFT JOIN recorded AS o ON l.other_clock_id = o.clock_id
),
-- The hulls as far as possible lines can follow them: where a hull is steeper, the steepest line
-- counts.
limited AS MATERIALIZED (
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
        FROM edge
    ) AS c
    JOIN line AS l ON c.clock_id = l.clock_id AND c.other_clock_id = l.other_clock_id
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
        c.clock_id, c.other_clock_id, c.sense, e.begin_moment - 1,
        arg_min(c.bound, c.moment)
        - any_value(c.steepest) * (min(c.moment) - e.begin_moment + 1),
        any_value(c.steepest)
    FROM limited AS c
    JOIN extent AS e ON c.clock_id = e.clock_id AND c.other_clock_id = e.other_clock_id
    GROUP BY c.clock_id, c.other_clock_id, c.sense, e.begin_moment
),
knot AS (
    SELECT clock_id, other_clock_id, moment FROM limited
    UNION
    SELECT clock_id, other_clock_id, moment FROM line
    UNION
    SELECT clock_id, other_clock_id, begin_moment FROM extent
    UNION
    SELECT clock_id, other_clock_id, end_moment FROM extent
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
    JOIN line AS l ON k.clock_id = l.clock_id AND k.other_clock_id = l.other_clock_id
    ASOF JOIN limit_edge AS e
        ON k.clock_id = e.clock_id
        AND k.other_clock_id = e.other_clock_id
        AND k.sense = e.sense
        AND k.moment >= e.moment
    GROUP BY k.clock_id, k.other_clock_id, k.moment
),
-- The greater of the two has a corner where they are equal.
bounded AS (
    SELECT clock_id, other_clock_id, moment, greatest(below, above) AS error
    FROM apart
    UNION ALL
    SELECT
        clock_id, other_clock_id, moment + share * (next_moment - moment),
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
    UNION ALL
    SELECT m.clock_id, m.other_clock_id, unnest([e.begin_moment, e.end_moment]), m.greatest_miss
    FROM miss AS m
    JOIN extent AS e ON m.clock_id = e.clock_id AND m.other_clock_id = e.other_clock_id
),
known AS (
    SELECT
        clock_id, other_clock_id, max(uncertainty_ns) AS greatest_uncertainty_ns,
        list({'at_ns': at_ns, 'uncertainty_ns': uncertainty_ns} ORDER BY at_ns) AS bounds
    FROM (
        SELECT
            b.clock_id, b.other_clock_id, p.base_ns + round(b.moment)::BIGINT AS at_ns,
            ceil(max(b.error))::BIGINT AS uncertainty_ns
        FROM bounded AS b
        JOIN pair AS p ON b.clock_id = p.clock_id AND b.other_clock_id = p.other_clock_id
        GROUP BY ALL
    )
    GROUP BY clock_id, other_clock_id
)
SELECT
    p.clock_id,
    p.other_clock_id,
    p.received_count,
    p.sent_count,
    p.received_packet_count,
    p.sent_packet_count,
    p.base_ns + l.moment::BIGINT AS reference_ns,
    p.base_bound_ns + l.middle::BIGINT AS offset_ns,
    l.drift_ppb::BIGINT AS drift_ppb,
    coalesce(m.greatest_miss, ceil(l.distance / 2))::BIGINT AS uncertainty_ns,
    CASE
        WHEN l.is_even THEN greatest(
            ceil(greatest(l.highest * 1e9 - l.drift_ppb, l.drift_ppb - l.lowest * 1e9)), 1
        )
    END::BIGINT AS drift_uncertainty_ppb,
    l.is_even,
    k.greatest_uncertainty_ns,
    k.bounds
FROM pair AS p
LEFT JOIN line AS l ON p.clock_id = l.clock_id AND p.other_clock_id = l.other_clock_id
LEFT JOIN miss AS m ON p.clock_id = m.clock_id AND p.other_clock_id = m.other_clock_id
LEFT JOIN known AS k ON p.clock_id = k.clock_id AND p.other_clock_id = k.other_clock_id
