-- name: staging.context
-- description: Which thread and process the contexts of an event name, in each trace of the host.
-- grain: one row per trace, thread and process life
-- needs: staging.thread_life, staging.process, staging.thread, staging.trace
SELECT
    (r.trace_id - 1)::INTEGER AS trace_index,
    l.pid_ns,
    l.vpid,
    l.vtid,
    l.from_event_id,
    l.until_event_id,
    t.thread_id,
    p.process_id
FROM staging.thread_life AS l
JOIN staging.process AS p
    ON l.host_id = p.host_id
    AND l.pid_ns IS NOT DISTINCT FROM p.pid_namespace
    AND l.vpid = p.pid
    AND l.life = p.life
JOIN staging.thread AS t ON p.process_id = t.process_id AND l.vtid = t.tid
JOIN staging.trace AS r ON l.host_id = r.host_id
