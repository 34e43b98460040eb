-- name: staging.recording
-- description: Traces that are one recording: the chunks of a rotated one, or its snapshots.
-- grain: one row per CTF trace
-- when: staging.source
SELECT
    trace_index,
    min(trace_index) OVER (PARTITION BY coalesce(uuid, path)) AS recording_index
FROM staging.source
