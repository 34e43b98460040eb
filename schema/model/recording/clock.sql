-- description: Clocks by uuid (LTTng: the boot). A trace without one has a clock of its own, by
--     hostname. No correction is known at ingest.
-- grain: one row per clock
-- when: staging.placed_source
SELECT
    clock_id,
    arg_min(clock_uuid, coalesce(domain = 'kernel', false)) AS uuid,
    clock_key,
    0::BIGINT AS offset_ns,
    0::BIGINT AS drift_ppb,
    coalesce(min(begin_ns + shift_ns), 0) AS reference_ns,
    NULL::BIGINT AS uncertainty_ns,
    'none' AS method,
    NULL::BIGINT AS drift_uncertainty_ppb,
    NULL::BIGINT AS reference_clock_id
FROM staging.placed_source
GROUP BY clock_id, clock_key
