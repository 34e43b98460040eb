-- description: What store.clock holds of the clocks of a run that nothing corrects: their times are
--     as recorded, counted from the begin of their first trace.
-- grain: one row per clock
SELECT
    c.clock_id,
    0::BIGINT AS offset_ns,
    0::BIGINT AS drift_ppb,
    coalesce(min(t.start_ns), 0) AS reference_ns,
    NULL::BIGINT AS uncertainty_ns,
    NULL::BIGINT AS drift_uncertainty_ppb,
    NULL::BIGINT AS reference_clock_id,
    'none' AS method
FROM store.clock AS c
LEFT JOIN store.host AS h ON c.clock_id = h.clock_id
LEFT JOIN store.trace AS t ON h.host_id = t.host_id
WHERE c.run_id = $run_id
GROUP BY c.clock_id
ORDER BY c.clock_id
