-- name: derive.clock_envelope
-- kind: macro
-- description: The fastest messages and packets between two clocks, of each direction, in 256
--     stretches of the time, and which of them are corners of the convex hull: the lower envelope
--     of the delays. Leaving out others can only widen what they allow. So that a drift does not
--     hide which was fastest, its rough size (the regression through the fastest of each stretch as
--     they are) is taken out for the choice. Times count from `base_ns`, and differences from
--     `base_bound_ns`, which keeps them exact as DOUBLE.
-- grain: one row per pair of clocks, direction and stretch of the time
-- needs: derive.clock_bound
CREATE OR REPLACE MACRO derive.clock_envelope(of_run) AS TABLE
WITH bound AS MATERIALIZED (
    SELECT clock_id, other_clock_id, is_packet, sense, at_ns, bound_ns
    FROM derive.clock_bound(of_run)
),
base AS MATERIALIZED (
    SELECT
        clock_id, other_clock_id,
        min(at_ns) AS base_ns,
        max(at_ns) - min(at_ns) AS length_ns,
        least(max(CASE WHEN sense < 0 THEN at_ns END), max(CASE WHEN sense > 0 THEN at_ns END))
        - greatest(min(CASE WHEN sense < 0 THEN at_ns END), min(CASE WHEN sense > 0 THEN at_ns END))
            AS overlap_ns,
        coalesce(max(CASE WHEN sense < 0 THEN bound_ns END), min(-bound_ns)) AS base_bound_ns,
        count(CASE WHEN sense < 0 AND NOT is_packet THEN 1 END) AS received_count,
        count(CASE WHEN sense > 0 AND NOT is_packet THEN 1 END) AS sent_count,
        count(CASE WHEN sense < 0 AND is_packet THEN 1 END) AS received_packet_count,
        count(CASE WHEN sense > 0 AND is_packet THEN 1 END) AS sent_packet_count
    FROM bound
    GROUP BY clock_id, other_clock_id
),
placed AS MATERIALIZED (
    SELECT
        m.clock_id, m.other_clock_id, m.sense,
        (m.at_ns - b.base_ns) // (b.length_ns // 256 + 1) AS stretch,
        (m.at_ns - b.base_ns)::DOUBLE AS moment,
        (m.bound_ns + m.sense * b.base_bound_ns)::DOUBLE AS bound
    FROM bound AS m
    JOIN base AS b ON m.clock_id = b.clock_id AND m.other_clock_id = b.other_clock_id
),
rough AS (
    SELECT
        clock_id, other_clock_id, sense, stretch, arg_max(moment, bound) AS moment,
        max(bound) AS bound
    FROM placed
    GROUP BY clock_id, other_clock_id, sense, stretch
),
rough_drift AS (
    SELECT clock_id, other_clock_id, coalesce(avg(slope), 0) AS slope
    FROM (
        SELECT clock_id, other_clock_id, regr_slope(-sense * bound, moment) AS slope
        FROM rough
        GROUP BY clock_id, other_clock_id, sense
        HAVING count(*) > 1
    )
    GROUP BY clock_id, other_clock_id
),
fastest AS MATERIALIZED (
    SELECT
        p.clock_id, p.other_clock_id, p.sense, p.stretch,
        arg_max(p.moment, p.bound + p.sense * coalesce(d.slope, 0) * p.moment) AS moment,
        arg_max(p.bound, p.bound + p.sense * coalesce(d.slope, 0) * p.moment) AS bound
    FROM placed AS p
    LEFT JOIN rough_drift AS d
        ON p.clock_id = d.clock_id AND p.other_clock_id = d.other_clock_id
    GROUP BY p.clock_id, p.other_clock_id, p.sense, p.stretch
),
-- A corner lies above every line between two others: at most 256 of them are compared.
around AS (
    SELECT
        f.clock_id, f.other_clock_id, f.sense, f.moment, any_value(f.bound) AS bound,
        min(CASE WHEN o.moment < f.moment THEN (f.bound - o.bound) / (f.moment - o.moment) END)
            AS slope_before,
        max(CASE WHEN o.moment > f.moment THEN (o.bound - f.bound) / (o.moment - f.moment) END)
            AS slope_after
    FROM fastest AS f
    LEFT JOIN fastest AS o
        ON f.clock_id = o.clock_id
        AND f.other_clock_id = o.other_clock_id
        AND f.sense = o.sense
        AND f.moment <> o.moment
    GROUP BY f.clock_id, f.other_clock_id, f.sense, f.moment
)
SELECT
    a.clock_id, a.other_clock_id, a.sense, a.moment, a.bound,
    coalesce(a.slope_before > a.slope_after, true) AS is_corner,
    b.base_ns, b.base_bound_ns, b.overlap_ns, b.received_count, b.sent_count,
    b.received_packet_count, b.sent_packet_count
FROM around AS a
JOIN base AS b ON a.clock_id = b.clock_id AND a.other_clock_id = b.other_clock_id
