-- name: staging.thread_seen
-- description: What the contexts of events say of the threads that they happened in.
-- grain: one row per host, PID namespace, pid and tid
-- when: raw.thread
SELECT r.thread_index, t.host_id, r.pid_ns, r.vpid, r.vtid
FROM raw.thread AS r
JOIN staging.trace AS t ON r.trace_index + 1 = t.trace_id
