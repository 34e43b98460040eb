-- name: derive.host_gap
-- description: Gaps in what a host recorded of its processes. Those of kernel traces are none.
-- grain: one row per such gap
SELECT t.host_id, l.start_ns, l.end_ns
FROM store.gap AS l
JOIN store.trace AS t ON l.trace_id = t.trace_id
WHERE t.domain IS DISTINCT FROM 'kernel'
