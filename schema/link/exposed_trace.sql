-- name: derive.exposed_trace
-- description: Traces whose recording has gaps. The chunks of a rotated trace, and the snapshots of
--     one session, are one recording.
-- grain: one row per such trace
-- needs: store.trace, store.loss_interval
SELECT run_id, trace_id, recording_id
FROM (
    SELECT
        run_id, trace_id,
        min(trace_id) OVER (PARTITION BY run_id, coalesce(uuid, path)) AS recording_id,
        bool_or(trace_id IN (SELECT trace_id FROM store.loss_interval)) OVER (
            PARTITION BY run_id, coalesce(uuid, path)
        ) AS has_gaps
    FROM store.trace
)
WHERE has_gaps
