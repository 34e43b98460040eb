-- name: staging.cpu_schedule
-- description: For how long a kernel trace says what ran on each CPU.
-- grain: one row per kernel trace and CPU
-- when: raw.sched_switch
-- column: number INTEGER  Number of the row
-- column: trace_index INTEGER  The kernel trace
-- column: cpu INTEGER  The CPU
-- column: length_ns BIGINT [ns]  From its first switch to the last
-- column: known_ns BIGINT [ns]  Of that, between switches that do not contradict each other
-- column: start_ns BIGINT [ns]  Begin of the first time between such switches, as the trace has it
-- column: end_ns BIGINT [ns]  End of the last one, likewise
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
