-- description: PID namespaces of processes that some traces of a host have and others lack, where
--     all traces that have one have the same.
-- grain: one row per process
SELECT
    s.host, r.vpid,
    any_value(r.pid_ns) AS pid_ns
FROM raw.thread AS r
JOIN session_trace AS s ON r.trace_index = s.trace_index
WHERE r.vpid >= 0
GROUP BY s.host, r.vpid
HAVING min(r.pid_ns) = max(r.pid_ns) AND count(*) > count(r.pid_ns)
