-- title: Threads are not known to the kernel trace
-- description: Which of the kernel's threads these threads of ROS processes are is not known. There
--     are no states of them.
-- cause: They had no event while the kernel was traced.
-- cure: Record the kernel for as long as the ROS system (docs/scheduling.md).
-- grain: one row per process
-- severity: info
-- when: staging.schedule
SELECT
    p.process_id,
    count(*) AS count,
    printf(
        '%d threads of %s (pid %d) are not known to the kernel trace: no states of them',
        count(*), coalesce(p.name, '?'), p.pid
    ) AS detail
FROM staging.thread AS t
JOIN staging.process AS p ON t.process_id = p.process_id
JOIN staging.host AS h ON p.host_id = h.host_id
JOIN staging.clock AS c ON h.clock_id = c.clock_id
WHERE c.clock_key IN (SELECT clock_key FROM staging.schedule WHERE is_joined)
    AND t.thread_id NOT IN (SELECT thread_id FROM staging.thread_tid)
GROUP BY p.process_id, p.name, p.pid
