-- title: An executor waits for a CPU that runs nothing
-- description: A thread of an executor was ready, its CPU was idle and ran nothing from then on,
--     and the thread had to go to another one (main.withheld_cpu).
-- cause: The CPU was taken offline, or it is isolated (isolcpus, nohz_full, cpusets): the kernel
--     does not move threads to such CPUs or away from them.
-- cure: Compare /sys/devices/system/cpu/online and isolated with the CPUs that the thread may use
--     (taskset --cpu-list --pid TID).
-- grain: one row per thread of an executor and CPU
-- severity: warning
-- when: store.preemptor
SELECT
    run_id, thread_id,
    count(*) AS count,
    printf(
        'ready %s on CPU %d, which ran nothing from then on, %.3f ms in all',
        derive.counted(count(*), 'time'), cpu, sum(end_ns - start_ns) / 1e6
    ) AS detail
FROM main.withheld_cpu
WHERE reason = 'unused_cpu' AND thread_id IN (SELECT thread_id FROM main.executor_thread)
GROUP BY run_id, thread_id, cpu
