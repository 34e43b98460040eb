-- name: staging.exposed_trace
-- description: Traces whose recording has gaps.
-- grain: one row per such trace
-- when: staging.recording_gap
SELECT trace_index, recording_index
FROM staging.recording
WHERE recording_index IN (SELECT recording_index FROM staging.recording_gap)
