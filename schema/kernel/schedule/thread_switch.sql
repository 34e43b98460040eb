-- description: Switches of threads of ROS processes, in their order on each thread: onto a CPU, and
--     off it. Where the switch onto a CPU was not recorded, the first event of the thread there
--     tells that it has it: it got it after the switch at `unseen_since_ns`. Priorities are the
--     kernel's, which LTTng shows without the first 100.
-- grain: one row per thread and switch
-- when: staging.thread_tid

-- Each reader joins a part of them: a copy of all switches would take much memory.
WITH switch AS NOT MATERIALIZED (
    SELECT
        w.trace_index, w.event_id,
        w.ts_ns + s.shift_ns AS at_ns,
        s.clock_key,
        w.cpu_id AS cpu,
        w.prev_tid, w.prev_state, w.next_tid, s.shift_ns,
        w.prev_prio + CASE WHEN o.tracer LIKE 'perf%' THEN 0 ELSE 100 END AS prev_priority,
        w.next_prio + CASE WHEN o.tracer LIKE 'perf%' THEN 0 ELSE 100 END AS next_priority
    FROM raw.sched_switch AS w
    JOIN staging.schedule AS s ON w.trace_index = s.trace_index
    JOIN staging.source AS o ON w.trace_index = o.trace_index
    WHERE s.is_joined
),
unseen AS (
    SELECT
        w.event_id,
        b.ts_ns AS since_ns
    FROM raw.sched_switch AS w
    JOIN raw.sched_switch AS b
        ON w.trace_index = b.trace_index
        AND w.cpu_id = b.cpu_id
        AND w.switch_number - 1 = b.switch_number
    WHERE w.run_start_ns IS NULL AND w.prev_tid IN (SELECT tid FROM staging.thread_tid)
)
SELECT
    t.thread_id, t.tid, w.trace_index, w.event_id, w.at_ns, w.cpu,
    true AS is_on,
    NULL::BIGINT AS unseen_since_ns,
    w.next_priority AS priority,
    NULL::BIGINT AS prev_state
FROM switch AS w
JOIN staging.thread_tid AS t ON staging.has_tid(t, w.clock_key, w.next_tid, w.at_ns)
UNION ALL
SELECT
    t.thread_id, t.tid, w.trace_index, w.event_id, w.at_ns, w.cpu, false,
    u.since_ns + w.shift_ns,
    w.prev_priority, w.prev_state
FROM switch AS w
LEFT JOIN unseen AS u ON w.event_id = u.event_id
JOIN staging.thread_tid AS t ON staging.has_tid(t, w.clock_key, w.prev_tid, w.at_ns)
UNION ALL
SELECT
    t.thread_id, t.tid, s.trace_index,
    min(m.event_id),
    min(m.at_ns) + s.shift_ns,
    w.cpu, true,
    u.since_ns + s.shift_ns,
    w.prev_priority, NULL
FROM staging.schedule_moment AS m
JOIN staging.schedule AS s ON m.candidate_number = s.candidate_number
JOIN switch AS w ON m.contradiction_id = w.event_id
JOIN unseen AS u ON m.contradiction_id = u.event_id
JOIN staging.thread AS x
    ON m.thread_index = x.thread_index
    AND m.event_id >= x.from_event_id
    AND m.event_id < x.until_event_id
JOIN staging.thread_tid AS t
    ON x.thread_id = t.thread_id AND staging.has_tid(t, s.clock_key, m.tid, w.at_ns)
GROUP BY
    t.thread_id, t.tid, s.trace_index, m.contradiction_id, s.shift_ns, w.cpu, u.since_ns,
    w.prev_priority
