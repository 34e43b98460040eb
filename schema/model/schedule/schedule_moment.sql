-- name: staging.schedule_moment
-- description: What a kernel trace says of the CPU at each event of a ROS process: which thread
--     ran there.
-- grain: one row per event and candidate that covers it
-- when: staging.schedule_candidate
-- column: trace_index INTEGER  The kernel trace
-- column: clock_key VARCHAR  The clock that it may be of
-- column: shift_ns BIGINT [ns]  What is added to its times then
-- column: event_id BIGINT  The event
-- column: thread_index INTEGER  Its thread
-- column: at_ns BIGINT [epoch ns]  When, as the kernel trace would have it
-- column: tid INTEGER  What ran on its CPU
SELECT
    e.trace_index, e.clock_key, e.shift_ns, e.event_id, e.thread_index, e.at_ns, w.next_tid AS tid
FROM (
    SELECT
        c.trace_index, c.clock_key, c.shift_ns, v.event_id, v.thread_index, v.cpu_id,
        v.ts_ns - c.shift_ns AS at_ns
    FROM staging.event AS v
    JOIN staging.source AS s ON v.trace_index = s.trace_index
    JOIN staging.schedule_candidate AS c ON s.clock_key = c.clock_key
    WHERE v.ts_ns - c.shift_ns <= c.last_ns
) AS e
ASOF JOIN raw.sched_switch AS w
    ON e.trace_index = w.trace_index AND e.cpu_id = w.cpu_id AND e.at_ns >= w.ts_ns
