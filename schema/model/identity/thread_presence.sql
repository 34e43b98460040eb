-- name: staging.thread_presence
-- description: When each thread was seen, by the name that it had then. A name may come again.
-- grain: one row per stretch of events of a thread under one name
-- when: raw.thread_name
SELECT
    s.thread_index,
    s.host_id,
    s.pid_ns,
    s.vpid,
    s.vtid,
    n.procname,
    n.first_event_id,
    n.last_event_id,
    n.first_seen_ns,
    n.last_seen_ns
FROM raw.thread_name AS n
JOIN staging.thread_seen AS s ON n.thread_index = s.thread_index
