-- description: Traces that are one recording: the chunks of a rotated one, or the snapshots of one
--     session.
-- grain: one row per trace
SELECT
    run_id, trace_id,
    min(trace_id) OVER (PARTITION BY run_id, coalesce(uuid, path)) AS recording_id
FROM store.trace
