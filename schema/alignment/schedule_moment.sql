-- description: What a kernel trace says of the CPU at each event of a ROS process: which thread
--     ran there. The next switch tells, and the one before it has to say the same: else some switch
--     was not recorded, and what ran is not known (`contradiction_id`: the next switch). `tid` left
--     the CPU there.
-- grain: one row per event and candidate that covers it
-- when: staging.schedule_candidate
SELECT e.candidate_number, e.event_id, e.thread_index, e.at_ns, w.tid, w.contradiction_id
FROM (
    -- Few and narrow columns here and below: all events and all switches are sorted.
    SELECT
        c.candidate_number,
        p.number AS cpu_number,
        v.event_id, v.thread_index,
        v.ts_ns - c.shift_ns AS at_ns
    FROM staging.event AS v
    JOIN staging.source AS s ON v.trace_index = s.trace_index
    JOIN staging.schedule_candidate AS c ON s.clock_key = c.clock_key
    JOIN staging.cpu_schedule AS p ON c.trace_index = p.trace_index AND v.cpu_id = p.cpu
) AS e
ASOF JOIN (
    SELECT
        p.number AS cpu_number,
        w.ts_ns,
        CASE WHEN w.switch_number > 0 THEN w.prev_tid END AS tid,
        CASE WHEN w.run_start_ns IS NULL THEN w.event_id END AS contradiction_id
    FROM raw.sched_switch AS w
    JOIN staging.cpu_schedule AS p ON w.trace_index = p.trace_index AND w.cpu_id = p.cpu
) AS w
    ON e.cpu_number = w.cpu_number AND e.at_ns < w.ts_ns
WHERE w.tid IS NOT NULL
