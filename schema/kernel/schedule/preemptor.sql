-- description: What ran on the CPU for which a thread of a ROS process waited: no thread while that
--     CPU was idle.
-- grain: one row per wait for a CPU and stretch of time in which another thread had it, or none
-- when: staging.cpu_taken
SELECT
    c.thread_id, c.state_start_ns, c.wait_start_ns, c.start_ns, c.end_ns, c.state, c.cpu,
    t.thread_id AS preemptor_thread_id,
    CASE WHEN t.thread_id IS NULL THEN o.other_thread_id END AS preemptor_other_thread_id,
    CASE WHEN c.tid <> 0 THEN c.priority END AS preemptor_priority,
    c.thread_priority
FROM staging.cpu_taken AS c
LEFT JOIN staging.thread_tid AS t ON staging.has_tid(t, c.clock_key, c.tid, c.start_ns)
LEFT JOIN staging.other_thread AS o
    -- An idle CPU is in it where an interrupt there woke a thread.
    ON c.tid <> 0
    AND c.clock_key = o.clock_key
    AND c.tid = o.tid
    AND c.name IS NOT DISTINCT FROM o.name
ORDER BY c.thread_id, c.start_ns
