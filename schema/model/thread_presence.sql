-- name: staging.thread_presence
-- description: When each thread was seen, by the name that it had then.
-- grain: one row per host, PID namespace, pid, tid and thread name
-- needs: staging.event, staging.trace
SELECT
    t.host_id,
    e.pid_ns,
    e.vpid,
    e.vtid,
    e.procname,
    min(e.first_event_id) AS first_event_id,
    max(e.last_event_id) AS last_event_id,
    min(e.first_seen_ns) AS first_seen_ns,
    max(e.last_seen_ns) AS last_seen_ns
FROM (
    SELECT
        trace_index,
        pid_ns,
        vpid,
        vtid,
        procname,
        min(event_id) AS first_event_id,
        max(event_id) AS last_event_id,
        min(ts_ns) AS first_seen_ns,
        max(ts_ns) AS last_seen_ns
    FROM staging.event
    GROUP BY ALL
) AS e
JOIN staging.trace AS t ON e.trace_index + 1 = t.trace_id
GROUP BY ALL
