-- title: A quota keeps an executor from an idle CPU
-- description: A thread of an executor had more to do, and its CPU was idle, again and again until
--     a period of a quota was over (main.withheld_cpu). Callbacks take that much longer than they
--     compute.
-- cause: The processes of its cgroup may use so much CPU time in each period, and had used it up:
--     docker run --cpus, Kubernetes' limits, CPUQuota= of systemd, cpu.max.
-- cure: Raise or remove the quota. cpu.max of the cgroup says how much it is (cpu.cfs_quota_us in
--     version 1), cpu.stat how often it was used up (nr_throttled). More CPUs do not help: threads
--     that compute at once use it up sooner.
-- grain: one row per thread of an executor
-- severity: warning
-- when: store.preemptor
SELECT
    run_id, thread_id,
    count(*) AS count,
    printf(
        'ready %s while its CPU was idle, %.3f ms in all, %.3f ms at most',
        derive.counted(count(*), 'time'), sum(end_ns - start_ns) / 1e6,
        max(end_ns - start_ns) / 1e6
    ) AS detail
FROM main.withheld_cpu
WHERE reason = 'quota' AND thread_id IN (SELECT thread_id FROM main.executor_thread)
GROUP BY run_id, thread_id
