-- name: clocks
-- title: Clocks and how they are corrected
-- description: The clocks of a run, the hosts that have them, and what makes their times comparable
--     with those of others. Times of clocks with the same reference can be compared, to within the
--     sum of their uncertainties; the uncertainty grows with the time from the moment of reference.
-- grain: one row per clock
-- column: run_id BIGINT                       Run
-- column: hosts VARCHAR                       Hosts that have it
-- column: method VARCHAR                      'messages', 'packets' (those of kernel traces as
--     well) or 'file'; 'none': as recorded
-- column: reference VARCHAR                   Hosts of the clock whose times its times become;
--     NULL: not brought together with others
-- column: offset_ns BIGINT [ns]               Added to its times
-- column: uncertainty_ns BIGINT [ns]          Bound of the error of the offset
-- column: drift_ppb BIGINT [1e-9]             Added to its times, per time since reference_ns
-- column: drift_uncertainty_ppb BIGINT [1e-9]  Bound of the error of the drift; NULL: the
--     uncertainty of the offset holds throughout, or is not known
-- column: reference_ns BIGINT [epoch ns]      Moment at which the offset alone is added, as the
--     clock showed it
-- column: greatest_uncertainty_ns BIGINT [ns]  Bound of the error of its times anywhere in the
--     recording; at any time: main.clock_uncertainty
-- column: uuid VARCHAR                        UUID of the clock (LTTng: boot identity)
-- needs: main.clock, main.clock_uncertainty, main.host
WITH named AS (
    SELECT clock_id, string_agg(hostname, ', ' ORDER BY host_id) AS hosts
    FROM main.host
    GROUP BY clock_id
)
SELECT
    c.run_id,
    n.hosts,
    c.method,
    r.hosts AS reference,
    c.offset_ns,
    c.uncertainty_ns,
    c.drift_ppb,
    c.drift_uncertainty_ppb,
    c.reference_ns,
    coalesce(k.greatest_ns, c.uncertainty_ns) AS greatest_uncertainty_ns,
    c.uuid
FROM main.clock AS c
LEFT JOIN named AS n ON c.clock_id = n.clock_id
LEFT JOIN named AS r ON c.reference_clock_id = r.clock_id
LEFT JOIN (
    SELECT clock_id, max(uncertainty_ns) AS greatest_ns
    FROM main.clock_uncertainty
    GROUP BY clock_id
) AS k ON c.clock_id = k.clock_id
WHERE list_contains($runs, c.run_id)
ORDER BY c.run_id, c.clock_id
