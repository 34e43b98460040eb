-- name: staging.thread_waking
-- description: When threads of ROS processes were woken, and by what: the interrupt that the CPU
--     was handling, else the thread that ran there. A switch ends every interrupt.
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
    SELECT trace_index, event_id, ts_ns, cpu_id, tid FROM raw.sched_waking
    UNION ALL
    SELECT trace_index, event_id, ts_ns, cpu_id, tid FROM raw.sched_wakeup_new
    UNION ALL
    SELECT trace_index, event_id, ts_ns, cpu_id, tid
    FROM raw.sched_wakeup
    WHERE trace_index NOT IN (SELECT trace_index FROM raw.sched_waking)
),
woken AS (
    SELECT
        t.thread_id, t.tid, k.trace_index, k.event_id,
        k.ts_ns + s.shift_ns AS at_ns, k.cpu_id, s.clock_key
    FROM waking AS k
    JOIN staging.schedule AS s ON k.trace_index = s.trace_index
    JOIN staging.thread_tid AS t
        ON s.clock_key = t.clock_key
        AND k.tid = t.tid
        AND k.ts_ns + s.shift_ns >= t.from_ns
        AND k.ts_ns + s.shift_ns < t.until_ns
    WHERE s.is_joined
),
handling AS (
    SELECT trace_index, event_id, cpu_id, 'timer' AS kind, true AS is_open
    FROM raw.timer_hrtimer_expire_entry
    UNION ALL
    SELECT trace_index, event_id, cpu_id, 'timer', false FROM raw.timer_hrtimer_expire_exit
    UNION ALL
    SELECT trace_index, event_id, cpu_id, 'interrupt', true FROM raw.irq_handler_entry
    UNION ALL
    SELECT trace_index, event_id, cpu_id, 'interrupt', false FROM raw.irq_handler_exit
    UNION ALL
    SELECT trace_index, event_id, cpu_id, 'softirq', true FROM raw.irq_softirq_entry
    UNION ALL
    SELECT trace_index, event_id, cpu_id, 'softirq', false FROM raw.irq_softirq_exit
),
last_handling AS (
    SELECT w.event_id, k.kind, h.event_id AS handling_event_id, h.is_open
    FROM woken AS w
    CROSS JOIN (VALUES ('timer'), ('interrupt'), ('softirq')) AS k (kind)
    ASOF JOIN handling AS h
        ON w.trace_index = h.trace_index
        AND w.cpu_id = h.cpu_id
        AND k.kind = h.kind
        AND w.event_id > h.event_id
),
running AS (
    SELECT
        w.event_id, c.event_id AS switch_event_id, c.next_tid AS tid, c.next_comm AS name
    FROM woken AS w
    ASOF JOIN raw.sched_switch AS c
        ON w.trace_index = c.trace_index AND w.cpu_id = c.cpu_id AND w.event_id > c.event_id
),
innermost AS (
    SELECT h.event_id, arg_max(h.kind, h.handling_event_id) AS kind
    FROM last_handling AS h
    LEFT JOIN running AS r ON h.event_id = r.event_id
    WHERE h.is_open AND h.handling_event_id > coalesce(r.switch_event_id, -1)
    GROUP BY h.event_id
)
SELECT
    w.thread_id,
    w.tid,
    w.event_id,
    w.at_ns,
    coalesce(i.kind, CASE WHEN r.tid IS NOT NULL THEN 'thread' END) AS kind,
    w.clock_key,
    r.tid AS waker_tid,
    r.name AS waker_name
FROM woken AS w
LEFT JOIN running AS r ON w.event_id = r.event_id
LEFT JOIN innermost AS i ON w.event_id = i.event_id
