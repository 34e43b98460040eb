-- description: Threads without ROS events that had the CPU while one with such events waited for
--     it, or woke it, and their program, as far as the kernel trace has it. The kernel's idle
--     thread takes no CPU; but it may be what an interrupt interrupted that woke a thread.
-- grain: one row per host, tid and name
-- when: staging.schedule_interval
WITH seen AS (
    SELECT
        clock_key, tid, name,
        start_ns AS at_ns
    FROM staging.cpu_taken
    WHERE tid <> 0
    UNION ALL
    SELECT w.clock_key, w.waker_tid, w.waker_name, w.at_ns
    FROM staging.thread_waking AS w
    WHERE w.waker_tid IS NOT NULL
        AND w.event_id IN (SELECT waking_event_id FROM staging.schedule_interval)
),
host AS (
    SELECT
        s.clock_key,
        min(t.host_id) AS host_id
    FROM staging.schedule AS s
    JOIN staging.trace AS t ON s.trace_index + 1 = t.trace_id
    WHERE s.is_joined
    GROUP BY s.clock_key
),
member AS (
    SELECT
        s.clock_key, m.tid,
        arg_max(m.pid, m.event_id) AS pid
    FROM (
        SELECT trace_index, event_id, tid, pid
        FROM raw.lttng_statedump_process_state
        UNION ALL
        SELECT trace_index, event_id, child_tid, child_pid
        FROM raw.sched_process_fork
        WHERE child_tid IS NOT NULL
        UNION ALL
        -- perf says -1 of a thread that ends.
        SELECT trace_index, event_id, prev_tid, perf_pid
        FROM raw.sched_switch
        WHERE perf_pid > 0
    ) AS m
    JOIN staging.schedule AS s ON m.trace_index = s.trace_index
    WHERE s.is_joined
    GROUP BY s.clock_key, m.tid
),
executed AS (
    SELECT
        s.clock_key,
        e.tid AS pid,
        arg_max(e.filename, e.event_id) AS command
    FROM raw.sched_process_exec AS e
    JOIN staging.schedule AS s ON e.trace_index = s.trace_index
    WHERE s.is_joined
    GROUP BY s.clock_key, e.tid
),
-- The first thread of a process has its number, and as a rule its name.
first AS (
    SELECT
        host_id, tid,
        any_value(name) AS name
    FROM staging.cpu_usage
    GROUP BY host_id, tid
),
of_ros AS (
    SELECT
        m.clock_key, m.pid,
        min(t.process_id) AS process_id
    FROM staging.thread_tid AS k
    JOIN member AS m ON k.clock_key = m.clock_key AND k.tid = m.tid
    JOIN staging.thread AS t ON k.thread_id = t.thread_id
    GROUP BY m.clock_key, m.pid
)
SELECT
    row_number() OVER (ORDER BY h.host_id, o.tid, o.name) AS other_thread_id,
    h.host_id, o.tid, o.name, m.pid,
    coalesce(f.name, o.name) AS program,
    e.command, r.process_id, o.clock_key
FROM (
    SELECT DISTINCT o.clock_key, o.tid, o.name
    FROM seen AS o
    LEFT JOIN staging.thread_tid AS t ON staging.has_tid(t, o.clock_key, o.tid, o.at_ns)
    WHERE t.thread_id IS NULL
) AS o
JOIN host AS h ON o.clock_key = h.clock_key
LEFT JOIN member AS m ON o.clock_key = m.clock_key AND o.tid = m.tid
LEFT JOIN executed AS e ON m.clock_key = e.clock_key AND m.pid = e.pid
LEFT JOIN first AS f ON h.host_id = f.host_id AND m.pid = f.tid
LEFT JOIN of_ros AS r ON m.clock_key = r.clock_key AND m.pid = r.pid
