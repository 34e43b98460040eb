-- title: Less urgent threads delay an executor with real-time priority
-- description: An executor with real-time priority slept in a callback until another thread woke
--     it, and that one had to wait for a CPU which a thread had that is less urgent than the
--     executor. What the kernel itself does is real_time_limit.
-- cause: The callback waits for what the waker does: for a lock that it holds, or a condition. With
--     its own priority the waker gets no CPU before others.
-- cure: Use mutexes with priority inheritance (PTHREAD_PRIO_INHERIT), raise the priority of the
--     waker, or do not wait for it. msgflow query critical-path says what that thread did
--     meanwhile.
-- grain: one row per thread of an executor
-- severity: warning
-- when: store.thread_state
WITH urgent AS (
    SELECT
        run_id, thread_id, start_ns, end_ns, priority, waker_thread_id
    FROM main.thread_state
    -- Of an interrupt the waker is only what it interrupted.
    WHERE priority < 100
        AND state = 'sleeping'
        AND waker_kind = 'thread'
        AND thread_id IN (SELECT thread_id FROM main.executor_thread)
),
asleep AS (
    SELECT u.run_id, u.thread_id, u.start_ns, u.end_ns, u.priority, u.waker_thread_id
    FROM urgent AS u
    ASOF JOIN (
        SELECT thread_id, start_ns, end_ns FROM main.callback_instance WHERE parent_id IS NULL
    ) AS i
        ON u.thread_id = i.thread_id AND u.start_ns >= i.start_ns
    WHERE i.end_ns >= u.end_ns
),
delay AS (
    SELECT
        a.run_id, a.thread_id,
        sum(least(a.end_ns, w.end_ns) - greatest(a.start_ns, w.start_ns)) AS length_ns
    FROM asleep AS a
    JOIN main.preemptor AS w
        ON a.waker_thread_id = w.thread_id AND w.start_ns < a.end_ns AND w.end_ns > a.start_ns
    WHERE w.thread_priority > a.priority AND w.preemptor_priority > a.priority
    GROUP BY a.run_id, a.thread_id, a.start_ns
)
SELECT
    run_id, thread_id,
    count(*) AS count,
    printf(
        'delayed %s by less urgent threads, %.3f ms in all, %.3f ms at most',
        derive.counted(count(*), 'time'), sum(length_ns) / 1e6, max(length_ns) / 1e6
    ) AS detail
FROM delay
GROUP BY run_id, thread_id
