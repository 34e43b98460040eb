-- title: Clocks and how they are corrected
-- description: The clocks of a run, the hosts that have them, and how their times are corrected.
--     Times of clocks with the same reference can be compared, to within the sum of their
--     uncertainties. The uncertainty grows with the distance from the moment of reference.
-- grain: one row per clock
-- variant: by VARCHAR {clock|pair} = 'clock'  What a row is: a clock, or two of them with the
--     messages and packets between them
-- column: run_id
-- column: hosts VARCHAR [host]  Hosts that have it
-- column: method VARCHAR                      'messages', 'packets' (those of kernel traces as
--     well) or 'file'; 'reference': others are corrected to it; 'none': as recorded
-- column: reference VARCHAR                   Hosts of the clock that this one is corrected to;
--     empty: not brought together with others
-- column: offset_ns BIGINT [ns]               Added to its times
-- column: uncertainty_ns BIGINT [ns]          Bound of the error of the offset
-- column: drift_ppb BIGINT [1e-9]             Added to its times, per unit of time since
--     reference_ns
-- column: drift_uncertainty_ppb BIGINT [1e-9]  Bound of the error of the drift; empty: the
--     uncertainty of the offset holds throughout, or is not known
-- column: reference_ns BIGINT [epoch ns]      Moment, by this clock, at which only the offset is
--     added
-- column: greatest_uncertainty_ns BIGINT [ns]  Largest bound of the error of its times in the
--     recording; main.clock_uncertainty has the bound at any moment
-- column: uuid VARCHAR                        UUID of the clock (LTTng: boot identity)
-- brief: hosts, method, reference, offset_ns, uncertainty_ns, greatest_uncertainty_ns, drift_ppb
WITH named AS (
    SELECT
        clock_id,
        string_agg(hostname, ', ' ORDER BY host_id) AS hosts
    FROM main.host
    GROUP BY clock_id
)
SELECT
    c.run_id, n.hosts,
    CASE
        WHEN c.method = 'none' AND c.clock_id IN (
            SELECT o.reference_clock_id
            FROM main.clock AS o
            WHERE o.clock_id <> o.reference_clock_id
        ) THEN 'reference'
        ELSE c.method
    END AS method,
    r.hosts AS reference,
    c.offset_ns, c.uncertainty_ns, c.drift_ppb, c.drift_uncertainty_ppb, c.reference_ns,
    coalesce(k.greatest_ns, c.uncertainty_ns) AS greatest_uncertainty_ns,
    c.uuid
FROM main.clock AS c
LEFT JOIN named AS n ON c.clock_id = n.clock_id
LEFT JOIN named AS r ON c.reference_clock_id = r.clock_id
LEFT JOIN (
    SELECT
        clock_id,
        max(uncertainty_ns) AS greatest_ns
    FROM main.clock_uncertainty
    GROUP BY clock_id
) AS k ON c.clock_id = k.clock_id
WHERE list_contains($runs, c.run_id)
ORDER BY c.run_id, c.clock_id
