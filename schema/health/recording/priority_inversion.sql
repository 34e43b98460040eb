-- name: finding.priority_inversion
-- title: Less urgent threads delay an executor with real-time priority
-- description: An executor with real-time priority lost the CPU to a less urgent thread, or slept
--     in a callback until a less urgent thread of a ROS process woke it.
-- cause: The callback waits for a lock or a condition that a less urgent thread holds. Or the
--     kernel throttles real-time threads (/proc/sys/kernel/sched_rt_runtime_us).
-- cure: Use mutexes with priority inheritance (PTHREAD_PRIO_INHERIT), raise the priority of the
--     thread that holds the lock, or share no lock with it. msgflow query critical-path says what
--     that thread did meanwhile.
-- grain: one row per thread of an executor
-- severity: warning
-- when: store.thread_state
WITH urgent AS (
    SELECT run_id, thread_id, start_ns, end_ns, state, priority, preempted_by_priority,
        waker_thread_id
    FROM main.thread_state
    WHERE priority < 100 AND thread_id IN (SELECT thread_id FROM main.executor_thread)
),
delay AS (
    SELECT run_id, thread_id, end_ns - start_ns AS length_ns
    FROM urgent
    WHERE state = 'preempted' AND preempted_by_priority > priority
    UNION ALL
    SELECT u.run_id, u.thread_id, u.end_ns - u.start_ns
    FROM urgent AS u
    ASOF JOIN main.thread_state AS w
        ON u.waker_thread_id = w.thread_id AND u.end_ns >= w.start_ns
    ASOF JOIN main.callback_instance AS i
        ON u.thread_id = i.thread_id AND u.start_ns >= i.start_ns
    WHERE u.state = 'sleeping' AND w.priority > u.priority AND i.end_ns >= u.end_ns
)
SELECT
    d.run_id,
    printf('%s %d on %s', coalesce(t.name, '?'), t.tid, h.hostname) AS subject,
    count(*) AS count,
    printf(
        'delayed %s by less urgent threads, %.3f ms in all, %.3f ms at most',
        derive.counted(count(*), 'time'), sum(d.length_ns) / 1e6, max(d.length_ns) / 1e6
    ) AS detail
FROM delay AS d
JOIN main.thread AS t ON d.thread_id = t.thread_id
JOIN main.process AS p ON t.process_id = p.process_id
JOIN main.host AS h ON p.host_id = h.host_id
GROUP BY d.run_id, d.thread_id, t.name, t.tid, h.hostname
