-- name: staging.thread_waking
-- description: When threads of ROS processes were woken, and by what: the interrupt that the CPU
--     was handling, else the thread that ran there. A switch ends every interrupt. Where the next
--     switch contradicts that the thread ran, it is not known.
-- grain: one row per waking of such a thread
-- when: staging.thread_tid
-- column: thread_id BIGINT  The thread
-- column: tid INTEGER  Its number
-- column: event_id BIGINT [event order]  The waking
-- column: at_ns BIGINT [epoch ns]  When
-- column: kind VARCHAR  'thread', 'timer', 'interrupt' or 'softirq'; NULL: not known
-- column: clock_key VARCHAR  Clock of the host
-- column: waker_tid INTEGER  The thread that woke it, or that was interrupted
-- column: waker_name VARCHAR  Its name
WITH waking AS (
    SELECT trace_index, event_id, ts_ns, tid, switch_event_id, interrupt FROM raw.sched_waking
    UNION ALL
    SELECT trace_index, event_id, ts_ns, tid, switch_event_id, interrupt FROM raw.sched_wakeup_new
    UNION ALL
    SELECT trace_index, event_id, ts_ns, tid, switch_event_id, interrupt
    FROM raw.sched_wakeup
    WHERE trace_index NOT IN (SELECT trace_index FROM raw.sched_waking)
),
woken AS (
    SELECT
        t.thread_id, t.tid, k.event_id, k.ts_ns + s.shift_ns AS at_ns, s.clock_key,
        k.switch_event_id, k.interrupt
    FROM waking AS k
    JOIN staging.schedule AS s ON k.trace_index = s.trace_index
    JOIN staging.thread_tid AS t
        ON s.clock_key = t.clock_key
        AND k.tid = t.tid
        AND k.ts_ns + s.shift_ns >= t.from_ns
        AND k.ts_ns + s.shift_ns < t.until_ns
    WHERE s.is_joined
)
SELECT
    w.thread_id,
    w.tid,
    w.event_id,
    w.at_ns,
    coalesce(w.interrupt, CASE WHEN r.next_tid IS NOT NULL THEN 'thread' END) AS kind,
    w.clock_key,
    r.next_tid AS waker_tid,
    r.next_comm AS waker_name
FROM woken AS w
LEFT JOIN (
    SELECT r.event_id, r.next_tid, r.next_comm
    FROM raw.sched_switch AS r
    LEFT JOIN raw.sched_switch AS e
        ON r.trace_index = e.trace_index
        AND r.cpu_id = e.cpu_id
        AND r.switch_number + 1 = e.switch_number
    WHERE e.event_id IS NULL OR e.run_start_ns IS NOT NULL
) AS r ON w.switch_event_id = r.event_id
