-- name: staging.context
-- description: Which thread and process an event is of, by where it says that it happened.
-- grain: one row per thread of a process life
-- when: staging.thread_life
SELECT
    l.thread_index,
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
