-- description: Waits of threads for a CPU: preempted, or woken. A wait is cut where the thread goes
--     to another CPU. A woken thread waits for the CPU that its waking names, until it is moved;
--     where the trace has no migrations, for that on which it goes on.
-- grain: one row per wait and CPU
-- when: staging.schedule_interval

-- Two kernel traces of a host have the same migrations: those count of the trace of the wait.
WITH migration AS (
    SELECT
        m.trace_index, t.thread_id, t.tid,
        m.ts_ns + s.shift_ns AS at_ns,
        m.dest_cpu AS cpu
    FROM raw.sched_migrate_task AS m
    JOIN staging.schedule AS s ON m.trace_index = s.trace_index
    JOIN staging.thread_tid AS t ON staging.has_tid(t, s.clock_key, m.tid, m.ts_ns + s.shift_ns)
    WHERE s.is_joined
),
wait AS (SELECT * FROM staging.schedule_interval WHERE state IN ('preempted', 'runnable')),
begin AS (
    SELECT
        w.thread_id, w.tid,
        w.start_ns AS state_start_ns,
        w.start_ns,
        CASE
            WHEN m.at_ns = w.start_ns THEN m.cpu
            WHEN w.state = 'preempted' THEN w.cpu
            WHEN w.trace_index NOT IN (SELECT trace_index FROM raw.sched_migrate_task)
                THEN coalesce(w.next_cpu, w.cpu)
            ELSE k.target_cpu
        END AS cpu
    FROM wait AS w
    LEFT JOIN staging.thread_waking AS k ON w.waking_event_id = k.event_id
    ASOF LEFT JOIN migration AS m
        ON w.trace_index = m.trace_index
        AND w.thread_id = m.thread_id
        AND w.tid = m.tid
        AND w.start_ns >= m.at_ns
),
cut AS (
    SELECT
        m.thread_id, m.tid,
        w.start_ns AS state_start_ns,
        m.at_ns AS start_ns,
        m.cpu
    FROM migration AS m
    ASOF JOIN wait AS w
        ON m.trace_index = w.trace_index
        AND m.thread_id = w.thread_id
        AND m.tid = w.tid
        AND m.at_ns > w.start_ns
    WHERE m.at_ns < w.end_ns
),
part AS (
    SELECT * FROM begin
    UNION ALL
    SELECT * FROM cut
)
SELECT
    row_number() OVER (ORDER BY p.thread_id, p.tid, p.start_ns) AS number,
    p.thread_id, p.tid, p.state_start_ns, p.start_ns,
    lead(p.start_ns, 1, w.end_ns) OVER (
        PARTITION BY p.thread_id, p.tid, p.state_start_ns ORDER BY p.start_ns
    ) AS end_ns,
    w.state, w.trace_index, p.cpu, w.priority
FROM part AS p
JOIN wait AS w ON p.thread_id = w.thread_id AND p.tid = w.tid AND p.state_start_ns = w.start_ns
