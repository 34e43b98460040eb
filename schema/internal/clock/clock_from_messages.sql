-- description: What store.clock holds of the clocks of a run that messages and packets bring
--     together; whether they connect the clock with another one, since it stays as it is if not;
--     and how far it can be wrong at some moments, a list.
-- grain: one row per clock
SELECT
    clock_id, offset_ns, drift_ppb, reference_ns, uncertainty_ns, drift_uncertainty_ppb,
    reference_clock_id,
    CASE
        WHEN clock_id = reference_clock_id THEN 'none'
        WHEN has_packets THEN 'packets'
        ELSE 'messages'
    END AS method,
    count(*) OVER (PARTITION BY reference_clock_id) > 1 AS is_connected,
    bounds
FROM derive.clock_sync($run_id)
ORDER BY clock_id
