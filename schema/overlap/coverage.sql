-- description: The time in which a session recorded programs on each CPU.
-- grain: one row per session and CPU
SELECT
    s.host, s.session, p.cpu_id,
    min(coalesce(p.begin_ns, o.begin_ns, p.last_event_ns)) AS begin_ns,
    max(greatest(p.end_ns, p.last_event_ns, p.begin_ns)) AS end_ns
FROM raw.packet AS p
JOIN session_trace AS s ON p.trace_index = s.trace_index
JOIN staging.source AS o ON p.trace_index = o.trace_index
WHERE o.domain IS DISTINCT FROM 'kernel'
GROUP BY s.host, s.session, p.cpu_id
