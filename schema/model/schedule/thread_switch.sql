-- name: staging.thread_switch
-- description: Switches of threads of ROS processes, in their order on each thread: onto a CPU, and
--     off it. Priorities are the kernel's, which LTTng shows without the first 100.
-- grain: one row per thread and switch
-- when: staging.thread_tid
-- column: thread_id BIGINT  The thread
-- column: tid INTEGER  Its number
-- column: trace_index INTEGER  The kernel trace
-- column: event_id BIGINT [event order]  The switch
-- column: at_ns BIGINT [epoch ns]  When
-- column: cpu INTEGER  The CPU
-- column: is_on BOOLEAN  The thread got the CPU
-- column: priority INTEGER  Its priority
-- column: prev_state BIGINT  State in which it left the CPU, as the kernel has it
WITH switch AS (
    SELECT
        w.trace_index, w.event_id, w.ts_ns + s.shift_ns AS at_ns, s.clock_key, w.cpu_id AS cpu,
        w.prev_tid, w.prev_state, w.next_tid,
        w.prev_prio + CASE WHEN o.tracer LIKE 'perf%' THEN 0 ELSE 100 END AS prev_priority,
        w.next_prio + CASE WHEN o.tracer LIKE 'perf%' THEN 0 ELSE 100 END AS next_priority
    FROM raw.sched_switch AS w
    JOIN staging.schedule AS s ON w.trace_index = s.trace_index
    JOIN staging.source AS o ON w.trace_index = o.trace_index
    WHERE s.is_joined
)
SELECT
    t.thread_id, t.tid, w.trace_index, w.event_id, w.at_ns, w.cpu, true AS is_on,
    w.next_priority AS priority, NULL::BIGINT AS prev_state
FROM switch AS w
JOIN staging.thread_tid AS t
    ON w.clock_key = t.clock_key
    AND w.next_tid = t.tid
    AND w.at_ns >= t.from_ns
    AND w.at_ns < t.until_ns
UNION ALL
SELECT
    t.thread_id, t.tid, w.trace_index, w.event_id, w.at_ns, w.cpu, false,
    w.prev_priority, w.prev_state
FROM switch AS w
JOIN staging.thread_tid AS t
    ON w.clock_key = t.clock_key
    AND w.prev_tid = t.tid
    AND w.at_ns >= t.from_ns
    AND w.at_ns < t.until_ns
