-- description: Traces whose recording has gaps.
-- grain: one row per such trace
SELECT run_id, trace_id, recording_id
FROM (
    SELECT
        run_id, trace_id, recording_id,
        bool_or(trace_id IN (SELECT trace_id FROM store.gap)) OVER (
            PARTITION BY run_id, recording_id
        ) AS has_gaps
    FROM derive.recording
)
WHERE has_gaps
