-- name: derive.recording_gap
-- description: Gaps of the recordings for ASOF joins: the last gap that starts before the end of a
--     window touches it, or one before that does, where `start_ns` or `covered_until_ns` is at or
--     after its begin.
-- grain: one row per gap in a recording
-- needs: store.loss_interval, derive.exposed_trace
SELECT
    l.run_id,
    x.recording_id,
    l.start_ns,
    max(l.end_ns) OVER (PARTITION BY x.recording_id ORDER BY l.start_ns) AS covered_until_ns
FROM store.loss_interval AS l
JOIN derive.exposed_trace AS x ON l.trace_id = x.trace_id
