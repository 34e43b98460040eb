-- name: staging.cpu_schedule
-- description: For how long a kernel trace says what ran on each CPU.
-- grain: one row per kernel trace and CPU
-- when: raw.sched_switch
-- column: trace_index INTEGER  The kernel trace
-- column: cpu INTEGER  The CPU
-- column: length_ns BIGINT [ns]  From its first switch to the last
-- column: known_ns BIGINT [ns]  Of that, between switches that do not contradict each other
SELECT
    trace_index,
    cpu_id AS cpu,
    max(ts_ns) - min(ts_ns) AS length_ns,
    coalesce(sum(ts_ns - run_start_ns), 0)::BIGINT AS known_ns
FROM raw.sched_switch
GROUP BY trace_index, cpu_id
