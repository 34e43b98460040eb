-- name: staging.recording_gap
-- description: Gaps for ASOF joins: a stretch of time touches a gap of its recording exactly where
--     the last gap that starts before its end starts at or after its begin, or the one or another
--     before it ends after its begin. CPU -1: all of them.
-- grain: one row per gap in a recording
-- when: staging.gap
SELECT
    r.recording_index,
    coalesce(l.cpu, -1) AS cpu_id,
    l.start_ns,
    max(l.end_ns) OVER (PARTITION BY r.recording_index, l.cpu ORDER BY l.start_ns)
        AS covered_until_ns,
    max(l.end_ns) OVER (PARTITION BY r.recording_index ORDER BY l.start_ns)
        AS any_covered_until_ns
FROM staging.gap AS l
JOIN staging.recording AS r ON l.trace_id - 1 = r.trace_index
