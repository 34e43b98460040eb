-- description: When each thread was seen, by the name that it had then. A name may come again.
-- grain: one row per stretch of events of a thread under one name
-- when: raw.thread_name
SELECT
    r.thread_index, s.host_id, r.pid_ns, r.vpid, r.vtid, n.procname, n.first_event_id,
    n.last_event_id, n.first_seen_ns, n.last_seen_ns
FROM raw.thread_name AS n
JOIN raw.thread AS r ON n.thread_index = r.thread_index
JOIN staging.placed_source AS s ON r.trace_index = s.trace_index
