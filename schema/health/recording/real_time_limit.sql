-- title: The kernel's limit of real-time threads keeps an executor from the CPU
-- description: A thread of an executor with real-time priority had more to do, and its CPU was
--     idle, or had a thread with normal priority (main.withheld_cpu). No thread can take the CPU
--     from one that is more urgent: the kernel itself did.
-- cause: Real-time threads may use 950 ms of each second, and used them up
--     (/proc/sys/kernel/sched_rt_runtime_us, sched_rt_period_us); cpu.rt_runtime_us of a cgroup
--     limits likewise. Since Linux 6.12 threads with normal priority get the rest only where some
--     wait.
-- cure: Compute less with real-time priority: a thread that needs a CPU for longer than that should
--     have a normal one. sysctl kernel.sched_rt_runtime_us=-1 removes the limit; then a thread that
--     never waits can stop the machine.
-- grain: one row per thread of an executor
-- severity: warning
-- when: store.preemptor
SELECT
    run_id, thread_id,
    count(*) AS count,
    printf(
        'ready %s while its CPU was idle or ran less urgent threads, %.3f ms in all, %.3f ms at '
        || 'most',
        derive.counted(count(*), 'time'), sum(end_ns - start_ns) / 1e6,
        max(end_ns - start_ns) / 1e6
    ) AS detail
FROM main.withheld_cpu
WHERE reason = 'real_time_limit' AND thread_id IN (SELECT thread_id FROM main.executor_thread)
GROUP BY run_id, thread_id
