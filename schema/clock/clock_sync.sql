-- description: How the times of each clock become those of a reference. The reference is the
--     first of the clocks that messages or packets in both directions connect. A clock that
--     exchanges none with the reference is joined through others, along the chain with the
--     smallest sum of greatest uncertainties; the errors of its steps add up. `bounds` holds the
--     error at some moments; between them it is at most a straight line.
-- grain: one row per clock
CREATE OR REPLACE MACRO derive.clock_sync(only_run) AS TABLE
WITH RECURSIVE pair AS MATERIALIZED (
    SELECT
        clock_id, other_clock_id, reference_ns, offset_ns,
        drift_ppb / 1e9 AS drift,
        uncertainty_ns,
        coalesce(drift_uncertainty_ppb, 0) / 1e9 AS drift_uncertainty,
        is_even,
        received_packet_count + sent_packet_count > 0 AS has_packets,
        greatest_uncertainty_ns, bounds
    FROM derive.clock_pair(only_run)
    WHERE offset_ns IS NOT NULL
),
-- The times of clock_id in those of other_clock_id, and the other way round.
step AS MATERIALIZED (
    SELECT
        clock_id, other_clock_id, reference_ns, offset_ns, drift, uncertainty_ns,
        drift_uncertainty, is_even, has_packets, greatest_uncertainty_ns
    FROM pair
    UNION ALL
    SELECT
        other_clock_id, clock_id,
        reference_ns + offset_ns,
        -offset_ns,
        1 / (1 + drift) - 1,
        ceil(uncertainty_ns / (1 + drift - drift_uncertainty))::BIGINT,
        drift_uncertainty / ((1 + drift) * (1 + drift - drift_uncertainty)),
        is_even, has_packets, greatest_uncertainty_ns
    FROM pair
),
chain (
    root_id, clock_id, next_clock_id, reference_ns, offset_ns, drift, uncertainty_ns,
    drift_uncertainty, is_even, has_packets, greatest_uncertainty_ns
) USING KEY (root_id, clock_id) AS (
    SELECT
        clock_id, clock_id,
        NULL::BIGINT,
        reference_ns,
        0::BIGINT,
        0::DOUBLE,
        0::BIGINT,
        0::DOUBLE,
        true, false,
        0::BIGINT
    FROM store.clock
    WHERE run_id = only_run
    UNION
    (
        SELECT
            c.root_id, s.clock_id, c.clock_id, s.reference_ns,
            s.offset_ns + c.offset_ns
            + round(c.drift * (s.reference_ns + s.offset_ns - c.reference_ns))::BIGINT,
            s.drift + c.drift + s.drift * c.drift,
            ceil(
                s.uncertainty_ns * (1 + abs(c.drift) + c.drift_uncertainty) + c.uncertainty_ns
                + c.drift_uncertainty * abs(s.reference_ns + s.offset_ns - c.reference_ns)
            )::BIGINT,
            s.drift_uncertainty * (1 + abs(c.drift) + c.drift_uncertainty)
            + c.drift_uncertainty * (1 + abs(s.drift)),
            s.is_even AND c.is_even,
            s.has_packets OR c.has_packets,
            s.greatest_uncertainty_ns + c.greatest_uncertainty_ns
        FROM chain AS c
        JOIN step AS s ON c.clock_id = s.other_clock_id
        LEFT JOIN recurring.chain AS k ON c.root_id = k.root_id AND s.clock_id = k.clock_id
        WHERE k.root_id IS NULL
            OR s.greatest_uncertainty_ns + c.greatest_uncertainty_ns < k.greatest_uncertainty_ns
        QUALIFY row_number() OVER (
            PARTITION BY c.root_id, s.clock_id
            ORDER BY s.greatest_uncertainty_ns + c.greatest_uncertainty_ns, c.clock_id
        ) = 1
    )
),
sync AS MATERIALIZED (
    SELECT
        root_id, clock_id, next_clock_id, reference_ns, offset_ns, drift,
        round(drift * 1e9) AS drift_ppb,
        uncertainty_ns, drift_uncertainty, is_even, has_packets
    FROM chain
    QUALIFY row_number() OVER (PARTITION BY clock_id ORDER BY root_id) = 1
),
-- Each clock and those on the way from it to the root, but for the root itself.
way (clock_id, via_id, next_clock_id) AS (
    SELECT clock_id, clock_id, next_clock_id FROM sync WHERE next_clock_id IS NOT NULL
    UNION ALL
    SELECT w.clock_id, s.clock_id, s.next_clock_id
    FROM way AS w
    JOIN sync AS s ON w.next_clock_id = s.clock_id
    WHERE s.next_clock_id IS NOT NULL
),
-- The bounds of each step, at times of the clock that it begins with.
step_bound AS (
    SELECT
        p.clock_id, p.other_clock_id, b.at_ns,
        b.uncertainty_ns::DOUBLE AS uncertainty_ns
    FROM pair AS p, unnest(p.bounds) AS bound (b)
    UNION ALL
    SELECT
        p.other_clock_id, p.clock_id,
        b.at_ns + p.offset_ns + round(p.drift * (b.at_ns - p.reference_ns))::BIGINT,
        b.uncertainty_ns * (1 + 2 * derive.clock_drift_limit())
    FROM pair AS p, unnest(p.bounds) AS bound (b)
),
piece AS MATERIALIZED (
    SELECT
        s.clock_id, b.at_ns, b.uncertainty_ns,
        first(b.at_ns) OVER along = b.at_ns AS is_first,
        (lead(b.uncertainty_ns) OVER along - b.uncertainty_ns)
        / (lead(b.at_ns) OVER along - b.at_ns) AS growth
    FROM sync AS s
    JOIN step_bound AS b ON s.clock_id = b.clock_id AND s.next_clock_id = b.other_clock_id
    WINDOW along AS (PARTITION BY s.clock_id ORDER BY b.at_ns)
),
-- Their moments on the clock at the begin of the chain, and back.
moment AS (
    SELECT
        w.clock_id,
        CASE
            WHEN w.via_id = w.clock_id THEN p.at_ns
            ELSE derive.recorded_ns(derive.corrected_ns(p.at_ns, v), c)
        END AS at_ns
    FROM way AS w
    JOIN piece AS p ON w.via_id = p.clock_id
    JOIN sync AS v ON w.via_id = v.clock_id
    JOIN sync AS c ON w.clock_id = c.clock_id
),
asked AS (
    SELECT
        m.clock_id, m.at_ns, w.via_id,
        CASE
            WHEN w.via_id = m.clock_id THEN m.at_ns
            ELSE derive.recorded_ns(derive.corrected_ns(m.at_ns, c), v)
        END AS via_at_ns,
        CASE WHEN v.next_clock_id = v.root_id THEN 0 ELSE 2 * derive.clock_drift_limit() END
            AS stretched
    FROM (SELECT DISTINCT clock_id, at_ns FROM moment) AS m
    JOIN way AS w ON m.clock_id = w.clock_id
    JOIN sync AS v ON w.via_id = v.clock_id
    JOIN sync AS c ON m.clock_id = c.clock_id
),
-- Outside the time that was recorded of a step, its bound grows as fast as clocks can drift apart.
summed AS (
    SELECT
        a.clock_id, a.at_ns,
        ceil(
            sum(
                (1 + a.stretched) * coalesce(
                    p.uncertainty_ns
                    + (a.via_at_ns - p.at_ns)
                    * coalesce(p.growth, 2 * derive.clock_drift_limit()),
                    f.uncertainty_ns + (f.at_ns - a.via_at_ns) * 2 * derive.clock_drift_limit()
                )
            )
        )::BIGINT AS uncertainty_ns
    FROM asked AS a
    JOIN piece AS f ON a.via_id = f.clock_id AND f.is_first
    ASOF LEFT JOIN piece AS p ON a.via_id = p.clock_id AND a.via_at_ns >= p.at_ns
    GROUP BY a.clock_id, a.at_ns
)
SELECT
    s.clock_id,
    s.root_id AS reference_clock_id,
    s.reference_ns, s.offset_ns,
    s.drift_ppb::BIGINT AS drift_ppb,
    s.uncertainty_ns,
    CASE WHEN s.is_even THEN ceil(
        s.drift_uncertainty * 1e9 + abs(s.drift * 1e9 - s.drift_ppb)
    ) END::BIGINT AS drift_uncertainty_ppb,
    s.has_packets, u.bounds
FROM sync AS s
LEFT JOIN (
    SELECT
        clock_id,
        list({'at_ns': at_ns, 'uncertainty_ns': uncertainty_ns} ORDER BY at_ns) AS bounds
    FROM summed
    GROUP BY clock_id
) AS u ON s.clock_id = u.clock_id
