-- name: derive.clock_sync
-- kind: macro
-- description: How the times of each clock become those of a reference: the first clock of those
--     that messages or packets in both directions connect. A clock that exchanges none with the
--     reference is joined through others, along the chain with the smallest sum of uncertainties;
--     the errors of its steps add up.
-- grain: one row per clock
-- needs: store.clock, derive.clock_pair
CREATE OR REPLACE MACRO derive.clock_sync(of_run) AS TABLE
WITH RECURSIVE pair AS MATERIALIZED (
    SELECT
        clock_id, other_clock_id, reference_ns, offset_ns, drift_ppb / 1e9 AS drift,
        uncertainty_ns, coalesce(drift_uncertainty_ppb, 0) / 1e9 AS drift_uncertainty, is_even,
        received_packet_count + sent_packet_count > 0 AS has_packets
    FROM derive.clock_pair(of_run)
    WHERE offset_ns IS NOT NULL
),
-- The times of clock_id in those of other_clock_id, and the other way round.
step AS MATERIALIZED (
    SELECT
        clock_id, other_clock_id, reference_ns, offset_ns, drift, uncertainty_ns,
        drift_uncertainty, is_even, has_packets
    FROM pair
    UNION ALL
    SELECT
        other_clock_id,
        clock_id,
        reference_ns + offset_ns,
        -offset_ns,
        1 / (1 + drift) - 1,
        ceil(uncertainty_ns / (1 + drift - drift_uncertainty))::BIGINT,
        drift_uncertainty / ((1 + drift) * (1 + drift - drift_uncertainty)),
        is_even,
        has_packets
    FROM pair
),
chain (
    root_id, clock_id, reference_ns, offset_ns, drift, uncertainty_ns, drift_uncertainty, is_even,
    has_packets
) USING KEY (root_id, clock_id) AS (
    SELECT
        clock_id, clock_id, reference_ns, 0::BIGINT, 0::DOUBLE, 0::BIGINT, 0::DOUBLE, true, false
    FROM store.clock
    WHERE run_id = of_run
    UNION
    (
        SELECT
            c.root_id,
            s.clock_id,
            s.reference_ns,
            s.offset_ns + c.offset_ns
            + round(c.drift * (s.reference_ns + s.offset_ns - c.reference_ns))::BIGINT,
            s.drift + c.drift + s.drift * c.drift,
            ceil(
                s.uncertainty_ns * (1 + abs(c.drift) + c.drift_uncertainty) + c.uncertainty_ns
                + c.drift_uncertainty * abs(s.reference_ns + s.offset_ns - c.reference_ns)
            )::BIGINT AS uncertainty_ns,
            s.drift_uncertainty * (1 + abs(c.drift) + c.drift_uncertainty)
            + c.drift_uncertainty * (1 + abs(s.drift)),
            s.is_even AND c.is_even,
            s.has_packets OR c.has_packets
        FROM chain AS c
        JOIN step AS s ON c.clock_id = s.other_clock_id
        LEFT JOIN recurring.chain AS k ON c.root_id = k.root_id AND s.clock_id = k.clock_id
        WHERE k.root_id IS NULL OR ceil(
            s.uncertainty_ns * (1 + abs(c.drift) + c.drift_uncertainty) + c.uncertainty_ns
            + c.drift_uncertainty * abs(s.reference_ns + s.offset_ns - c.reference_ns)
        ) < k.uncertainty_ns
        QUALIFY row_number() OVER (
            PARTITION BY c.root_id, s.clock_id
            ORDER BY s.uncertainty_ns + c.uncertainty_ns, c.clock_id
        ) = 1
    )
)
SELECT
    clock_id,
    root_id AS reference_clock_id,
    reference_ns,
    offset_ns,
    round(drift * 1e9)::BIGINT AS drift_ppb,
    uncertainty_ns,
    CASE WHEN is_even THEN ceil(drift_uncertainty * 1e9 + abs(drift * 1e9 - round(drift * 1e9)))
        END::BIGINT AS drift_uncertainty_ppb,
    has_packets
FROM chain
QUALIFY row_number() OVER (PARTITION BY clock_id ORDER BY root_id) = 1
