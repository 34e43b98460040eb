-- name: derive.clock_pair
-- kind: macro
-- description: How the times of one clock become those of another, from the messages and packets
--     between them in both directions. Every line between the two envelopes is possible. Where
--     these are nearest to each other, which is the shortest round trip that was observed once the
--     drift is taken out, the middle between them is the offset and half the distance bounds its
--     error; the line there that keeps away from both most is the drift, and the steepest and the
--     flattest line bound its error (Duda 1987; Poirier, Roy and Dagenais 2010; Jabbarifar and
--     Dagenais 2014).
--     With some in a quarter of the stretches, the bound of the drift is narrowed: one way at
--     one time and the other at another are supposed to take together at least three quarters of
--     the shortest round trip.
--     Where no line is possible, the clocks do not run evenly: the line that misses least is
--     given, and its error at any time is bounded by the fastest of each stretch.
--     Without any in both directions at the same time, all is NULL.
-- grain: one row per pair of clocks with messages or packets between them
-- needs: derive.clock_envelope
CREATE OR REPLACE MACRO derive.clock_pair(of_run) AS TABLE
WITH fastest AS MATERIALIZED (
    SELECT
        clock_id, other_clock_id, sense, moment, bound, is_corner, base_ns, base_bound_ns,
        overlap_ns, received_count, sent_count, received_packet_count, sent_packet_count
    FROM derive.clock_envelope(of_run)
),
corner AS MATERIALIZED (
    SELECT clock_id, other_clock_id, sense, moment, bound
    FROM fastest
    WHERE is_corner
),
pair AS (
    SELECT
        clock_id, other_clock_id, any_value(base_ns) AS base_ns,
        any_value(base_bound_ns) AS base_bound_ns,
        any_value(overlap_ns) AS overlap_ns,
        any_value(received_count) AS received_count,
        any_value(sent_count) AS sent_count,
        any_value(received_packet_count) AS received_packet_count,
        any_value(sent_packet_count) AS sent_packet_count,
        least(
            count(CASE WHEN sense < 0 THEN 1 END), count(CASE WHEN sense > 0 THEN 1 END)
        ) AS stretches
    FROM fastest
    GROUP BY clock_id, other_clock_id
),
edge AS (
    SELECT
        clock_id, other_clock_id, sense, moment, bound,
        lead(moment) OVER along AS next_moment,
        (lead(bound) OVER along - bound) / (lead(moment) OVER along - moment) AS slope
    FROM corner
    WINDOW along AS (PARTITION BY clock_id, other_clock_id, sense ORDER BY moment)
),
-- The envelopes are nearest at a corner of one of them.
distance AS (
    SELECT
        c.clock_id, c.other_clock_id, c.moment,
        -c.sense * c.bound AS own,
        c.sense * (e.bound + coalesce(e.slope, 0) * (c.moment - e.moment)) AS opposite,
        c.sense * e.slope AS slope,
        -c.bound - e.bound - coalesce(e.slope, 0) * (c.moment - e.moment) AS distance
    FROM corner AS c
    ASOF JOIN edge AS e
        ON c.clock_id = e.clock_id
        AND c.other_clock_id = e.other_clock_id
        AND -c.sense = e.sense
        AND c.moment >= e.moment
    WHERE e.next_moment IS NOT NULL OR e.moment = c.moment
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
        max(CASE WHEN u.moment < l.moment THEN (-u.bound - l.bound) / (u.moment - l.moment) END)
            AS lowest,
        min(CASE WHEN u.moment > l.moment THEN (-u.bound - l.bound) / (u.moment - l.moment) END)
            AS highest
    FROM corner AS l
    JOIN corner AS u ON l.clock_id = u.clock_id AND l.other_clock_id = u.other_clock_id
    WHERE l.sense < 0 AND u.sense > 0
    GROUP BY l.clock_id, l.other_clock_id
),
line AS (
    SELECT
        n.clock_id, n.other_clock_id, n.moment, n.own, n.opposite, n.distance, s.lowest, s.highest,
        round((n.own + n.opposite) / 2) AS middle,
        round(
            CASE
                WHEN n.distance < 0 THEN coalesce(n.slope, 0)
                ELSE greatest(
                    s.lowest, least(s.highest, coalesce(n.slope, (s.lowest + s.highest) / 2))
                )
            END * 1e9
        ) AS drift_ppb
    FROM nearest AS n
    JOIN steepness AS s ON n.clock_id = s.clock_id AND n.other_clock_id = s.other_clock_id
    WHERE s.lowest IS NOT NULL AND s.highest IS NOT NULL
),
-- How far the clocks can be from the line at any time, where no line is possible.
miss AS (
    SELECT
        l.clock_id, l.other_clock_id,
        max(-f.bound - f.sense * (l.middle + l.drift_ppb / 1e9 * (f.moment - l.moment)))
            AS greatest_miss
    FROM line AS l
    JOIN fastest AS f ON l.clock_id = f.clock_id AND l.other_clock_id = f.other_clock_id
    WHERE l.distance < 0
    GROUP BY l.clock_id, l.other_clock_id
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
    coalesce(ceil(m.greatest_miss), floor(l.distance / 2))::BIGINT AS uncertainty_ns,
    CASE
        WHEN l.distance >= 0
            THEN greatest(
                ceil(
                    greatest(l.highest * 1e9 - l.drift_ppb, l.drift_ppb - l.lowest * 1e9)
                    - CASE
                        WHEN p.stretches >= 64 THEN 0.75 * l.distance * 1e9 / p.overlap_ns
                        ELSE 0
                    END
                ),
                1
            )
    END::BIGINT AS drift_uncertainty_ppb,
    l.distance >= 0 AS is_even
FROM pair AS p
LEFT JOIN line AS l ON p.clock_id = l.clock_id AND p.other_clock_id = l.other_clock_id
LEFT JOIN miss AS m ON p.clock_id = m.clock_id AND p.other_clock_id = m.other_clock_id
