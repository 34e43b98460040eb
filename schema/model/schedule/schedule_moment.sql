-- name: staging.schedule_moment
-- description: What a kernel trace says of the CPU at each event of a ROS process: which thread
--     ran there. The next switch tells, and the one before it has to say the same: else some switch
--     was not recorded, and what ran is not known.
-- grain: one row per event and candidate that covers it
-- when: staging.schedule_candidate
-- column: trace_index INTEGER  The kernel trace
-- column: clock_key VARCHAR  The clock that it may be of
-- column: shift_ns BIGINT [ns]  What is added to its times then
-- column: event_id BIGINT  The event
-- column: thread_index INTEGER  Its thread
-- column: at_ns BIGINT [epoch ns]  When, as the kernel trace would have it
-- column: tid INTEGER  What left its CPU at the next switch
-- column: contradiction_id BIGINT [event order]  The next switch, if it contradicts the one before
SELECT
    e.trace_index, e.clock_key, e.shift_ns, e.event_id, e.thread_index, e.at_ns, w.tid,
    w.contradiction_id
FROM (
    SELECT
        c.trace_index, c.clock_key, c.shift_ns, v.event_id, v.thread_index, v.cpu_id,
        v.ts_ns - c.shift_ns AS at_ns
    FROM staging.event AS v
    JOIN staging.source AS s ON v.trace_index = s.trace_index
    JOIN staging.schedule_candidate AS c ON s.clock_key = c.clock_key
) AS e
ASOF JOIN (
    -- Few and narrow columns: all switches are sorted.
    SELECT
        trace_index, cpu_id, ts_ns,
        CASE WHEN switch_number > 0 THEN prev_tid END AS tid,
        CASE WHEN run_start_ns IS NULL THEN event_id END AS contradiction_id
    FROM raw.sched_switch
) AS w
    ON e.trace_index = w.trace_index AND e.cpu_id = w.cpu_id AND e.at_ns < w.ts_ns
WHERE w.tid IS NOT NULL
