-- description: For how long a kernel trace says what ran on each CPU: of the length from its first
--     switch to the last, `known_ns` lie between switches that do not contradict each other, the
--     first and last such time from `start_ns` to `end_ns`, as the trace has them.
-- grain: one row per kernel trace and CPU
-- when: raw.sched_switch
SELECT
    row_number() OVER (ORDER BY trace_index, cpu_id)::INTEGER AS number,
    trace_index,
    cpu_id AS cpu,
    max(ts_ns) - min(ts_ns) AS length_ns,
    coalesce(sum(ts_ns - run_start_ns), 0)::BIGINT AS known_ns,
    min(run_start_ns) FILTER (WHERE run_start_ns < ts_ns) AS start_ns,
    max(ts_ns) FILTER (WHERE run_start_ns < ts_ns) AS end_ns
FROM raw.sched_switch
GROUP BY trace_index, cpu_id
