-- description: How the times of one clock become those of another, from the messages and packets
--     between them in both directions. Every line between the two hulls is possible that is no
--     steeper than clocks can drift apart. The hulls are nearest to each other at the shortest
--     round trip that was observed, once the drift is taken out. There, the middle between them is
--     the offset, and half the distance bounds its error. The drift is that of the possible line
--     through this middle that is parallel to the longest edge of the hulls; the steepest and the
--     flattest possible line bound its error (Duda 1987; Poirier, Roy and Dagenais 2010; Jabbarifar
--     and Dagenais 2014). `bounds` holds how far a possible line is at most from the chosen one: at
--     some moments, with straight lines in between. It grows where nothing passes one way. Where no
--     line is possible, the clocks do not run evenly, or drift apart faster than clocks do. Then
--     the line that misses least is given, and its error at any time is bounded by the fastest
--     message or packet of each stretch. Without any in one of the directions, all is NULL.
-- grain: one row per pair of clocks with messages or packets between them
CREATE OR REPLACE MACRO derive.clock_pair(only_run) AS TABLE
WITH corner AS MATERIALIZED (
    SELECT
        clock_id, other_clock_id, sense, moment, bound, base_ns, base_bound_ns, received_count,
        sent_count, received_packet_count, sent_packet_count
    FROM derive.clock_hull(only_run)
),
pair AS MATERIALIZED (
    SELECT
        clock_id, other_clock_id,
        any_value(base_ns) AS base_ns,
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
        derive.clock_drift_limit(),
        true
    FROM corner
    GROUP BY clock_id, other_clock_id, sense
),
line AS MATERIALIZED (FROM derive.clock_line('corner', 'edge')),
-- How far the clocks can be from the line at any time, where no line is possible.
miss AS (
    SELECT
        clock_id, other_clock_id,
        ceil(max(abs(least_miss))) AS greatest_miss
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
    SELECT
        h.clock_id,
        min(t.start_ns) AS begin_ns,
        max(t.end_ns) AS end_ns
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
bounded AS (
    SELECT clock_id, other_clock_id, moment, error
    FROM derive.clock_line_error('edge', 'line', 'extent')
    UNION ALL
    SELECT
        m.clock_id, m.other_clock_id,
        unnest([e.begin_moment, e.end_moment]),
        m.greatest_miss
    FROM miss AS m
    JOIN extent AS e ON m.clock_id = e.clock_id AND m.other_clock_id = e.other_clock_id
),
known AS (
    SELECT
        clock_id, other_clock_id,
        max(uncertainty_ns) AS greatest_uncertainty_ns,
        list({'at_ns': at_ns, 'uncertainty_ns': uncertainty_ns} ORDER BY at_ns) AS bounds
    FROM (
        SELECT
            b.clock_id, b.other_clock_id,
            p.base_ns + round(b.moment)::BIGINT AS at_ns,
            ceil(max(b.error))::BIGINT AS uncertainty_ns
        FROM bounded AS b
        JOIN pair AS p ON b.clock_id = p.clock_id AND b.other_clock_id = p.other_clock_id
        GROUP BY ALL
    )
    GROUP BY clock_id, other_clock_id
)
SELECT
    p.clock_id, p.other_clock_id, p.received_count, p.sent_count, p.received_packet_count,
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
    l.is_even, k.greatest_uncertainty_ns, k.bounds
FROM pair AS p
LEFT JOIN line AS l ON p.clock_id = l.clock_id AND p.other_clock_id = l.other_clock_id
LEFT JOIN miss AS m ON p.clock_id = m.clock_id AND p.other_clock_id = m.other_clock_id
LEFT JOIN known AS k ON p.clock_id = k.clock_id AND p.other_clock_id = k.other_clock_id
