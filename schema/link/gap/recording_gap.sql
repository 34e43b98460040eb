-- description: Gaps of the recordings, for ASOF joins. To see whether a gap touches a window:
--     take the last gap that starts before the end of the window. One touches it if `start_ns` or
--     `covered_until_ns` of that gap is at or after the begin of the window.
-- grain: one row per gap in a recording
SELECT
    l.run_id, x.recording_id, l.start_ns,
    max(l.end_ns) OVER (
        PARTITION BY l.run_id, x.recording_id ORDER BY l.start_ns
    ) AS covered_until_ns
FROM store.gap AS l
JOIN derive.exposed_trace AS x ON l.trace_id = x.trace_id
