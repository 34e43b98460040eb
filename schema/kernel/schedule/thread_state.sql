-- description: States of threads of ROS processes, with what took the CPU and what woke them.
-- grain: one row per interval in which a thread had one state
-- when: staging.schedule_interval
WITH packet AS (
    SELECT
        s.clock_key, p.discarded_event_count,
        coalesce(p.last_event_ns, p.begin_ns) + s.shift_ns AS start_ns,
        coalesce(
            lead(p.begin_ns) OVER (PARTITION BY p.trace_index, p.stream_index ORDER BY p.position),
            p.end_ns
        ) + s.shift_ns AS end_ns
    FROM raw.packet AS p
    JOIN staging.schedule AS s ON p.trace_index = s.trace_index
    WHERE s.is_joined
),
-- When kernel events were lost on some CPU, by the time until which any earlier loss of the clock
-- reaches as well.
loss AS (
    SELECT
        clock_key, start_ns,
        max(end_ns) OVER (PARTITION BY clock_key ORDER BY start_ns) AS until_ns
    FROM packet
    WHERE discarded_event_count <> 0
),
interval AS (
    SELECT thread_id, start_ns, end_ns, state, cpu, priority, waking_event_id
    FROM staging.schedule_interval
    WHERE state <> 'preempted'
    UNION ALL
    SELECT thread_id, start_ns, end_ns, state, cpu, priority, NULL
    FROM staging.cpu_wait
    WHERE state = 'preempted'
)
SELECT
    row_number() OVER (ORDER BY i.thread_id, i.start_ns) AS number,
    i.thread_id, i.start_ns, i.end_ns, i.state, i.cpu, i.priority,
    p.preemptor_thread_id AS preempted_by_thread_id,
    p.preemptor_other_thread_id AS preempted_by_other_thread_id,
    p.preemptor_priority AS preempted_by_priority,
    p.thread_id IS NOT NULL AND p.preemptor_thread_id IS NULL
        AND p.preemptor_other_thread_id IS NULL AS is_cpu_idle,
    w.kind AS waker_kind,
    wt.thread_id AS waker_thread_id,
    CASE WHEN wt.thread_id IS NULL THEN wo.other_thread_id END AS waker_other_thread_id,
    coalesce(l.until_ns > i.start_ns, false) AS is_loss_affected
FROM interval AS i
JOIN (SELECT DISTINCT thread_id, clock_key FROM staging.thread_tid) AS t
    ON i.thread_id = t.thread_id
LEFT JOIN staging.preemptor AS p
    ON i.state = 'preempted' AND i.thread_id = p.thread_id AND i.start_ns = p.start_ns
LEFT JOIN staging.thread_waking AS w ON i.waking_event_id = w.event_id
LEFT JOIN staging.thread_tid AS wt ON staging.has_tid(wt, w.clock_key, w.waker_tid, w.at_ns)
LEFT JOIN staging.other_thread AS wo
    ON w.clock_key = wo.clock_key
    AND w.waker_tid = wo.tid
    AND w.waker_name IS NOT DISTINCT FROM wo.name
ASOF LEFT JOIN loss AS l ON t.clock_key = l.clock_key AND i.end_ns > l.start_ns
ORDER BY i.thread_id, i.start_ns
