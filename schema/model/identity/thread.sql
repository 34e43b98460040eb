-- name: staging.thread
-- description: Threads of all processes.
-- grain: one row per thread
-- when: staging.thread_life
SELECT
    row_number() OVER (ORDER BY t.first_event_id) AS thread_id,
    p.process_id,
    t.vtid AS tid,
    t.name,
    t.first_event_id,
    t.last_event_id,
    t.first_seen_ns,
    t.last_seen_ns
FROM staging.thread_life AS t
JOIN staging.process AS p
    ON t.host_id = p.host_id
    AND t.pid_ns IS NOT DISTINCT FROM p.pid_namespace
    AND t.vpid = p.pid
    AND t.life = p.life
