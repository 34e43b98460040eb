-- description: Gaps in what a host recorded of its processes, for ASOF joins as with
--     derive.recording_gap. Gaps of kernel traces do not count.
-- grain: one row per such gap
SELECT
    t.run_id, t.host_id, l.start_ns,
    max(l.end_ns) OVER (PARTITION BY t.run_id, t.host_id ORDER BY l.start_ns) AS covered_until_ns
FROM store.gap AS l
JOIN store.trace AS t ON l.trace_id = t.trace_id
WHERE t.domain IS DISTINCT FROM 'kernel'
