-- description: When threads of ROS processes were woken, and by what: the interrupt that the CPU
--     was handling, else the thread that ran there. A switch ends every interrupt. Where the kernel
--     trace contradicts itself about what ran, only a thread that is seen there is known. `kind` is
--     'thread', 'timer', 'interrupt' or 'softirq'; NULL: not known. `waker_tid` is the thread that
--     woke it, or that was interrupted; `target_cpu` the CPU on which it waits until it is moved.
-- grain: one row per waking of such a thread
-- when: staging.thread_tid
WITH waking AS (
    SELECT trace_index, event_id, ts_ns, tid, target_cpu, switch_event_id, interrupt
    FROM raw.sched_waking
    UNION ALL
    SELECT trace_index, event_id, ts_ns, tid, target_cpu, switch_event_id, interrupt
    FROM raw.sched_wakeup_new
    UNION ALL
    SELECT trace_index, event_id, ts_ns, tid, target_cpu, switch_event_id, interrupt
    FROM raw.sched_wakeup
    WHERE trace_index NOT IN (SELECT trace_index FROM raw.sched_waking)
),
woken AS (
    SELECT
        t.thread_id, t.tid, k.event_id,
        k.ts_ns + s.shift_ns AS at_ns,
        s.clock_key, s.shift_ns, k.target_cpu, k.switch_event_id, k.interrupt
    FROM waking AS k
    JOIN staging.schedule AS s ON k.trace_index = s.trace_index
    JOIN staging.thread_tid AS t ON staging.has_tid(t, s.clock_key, k.tid, k.ts_ns + s.shift_ns)
    WHERE s.is_joined
),
during AS (
    SELECT
        w.*, r.trace_index,
        r.cpu_id AS cpu,
        r.ts_ns + w.shift_ns AS from_ns,
        r.next_tid, r.next_comm,
        e.number IS NOT NULL AS is_contradicted
    FROM woken AS w
    LEFT JOIN raw.sched_switch AS r ON w.switch_event_id = r.event_id
    LEFT JOIN (
        SELECT
            trace_index, cpu_id,
            switch_number - 1 AS number
        FROM raw.sched_switch
        WHERE run_start_ns IS NULL
    ) AS e
        ON r.trace_index = e.trace_index AND r.cpu_id = e.cpu_id AND r.switch_number = e.number
),
found AS (
    SELECT
        d.*,
        CASE
            WHEN NOT d.is_contradicted THEN d.next_tid
            WHEN u.at_ns > d.from_ns THEN u.tid
        END AS waker_tid
    FROM during AS d
    ASOF LEFT JOIN (
        SELECT * FROM staging.thread_switch WHERE is_on AND unseen_since_ns IS NOT NULL
    ) AS u
        ON d.trace_index = u.trace_index AND d.cpu = u.cpu AND d.at_ns >= u.at_ns
)
SELECT
    thread_id, tid, event_id, at_ns,
    coalesce(interrupt, CASE WHEN waker_tid IS NOT NULL THEN 'thread' END) AS kind,
    clock_key, target_cpu, waker_tid,
    CASE WHEN NOT is_contradicted THEN next_comm END AS waker_name
FROM found
