-- description: How the time of callback instances divides into states of their threads.
-- grain: one row per callback instance that ended, on a thread with known states
-- when: staging.thread_state
WITH step AS (
    SELECT
        number,
        -- A thread that goes to another CPU while it waits for one does not lose the CPU again.
        lag(state) OVER thread IS DISTINCT FROM 'preempted' AS is_first,
        cpu <> lag(CASE WHEN state = 'running' THEN cpu END IGNORE NULLS) OVER thread
            AS is_migration
    FROM staging.thread_state
    WINDOW thread AS (PARTITION BY thread_id ORDER BY start_ns)
),
part AS (
    SELECT
        c.callback_instance_id,
        sum(c.end_ns - c.start_ns) FILTER (WHERE s.state = 'running') AS running_ns,
        sum(c.end_ns - c.start_ns) FILTER (WHERE s.state = 'preempted') AS preempted_ns,
        sum(c.end_ns - c.start_ns) FILTER (WHERE s.state = 'runnable') AS runnable_ns,
        sum(c.end_ns - c.start_ns) FILTER (WHERE s.state = 'sleeping') AS sleeping_ns,
        sum(c.end_ns - c.start_ns) FILTER (WHERE s.state = 'uninterruptible')
            AS uninterruptible_ns,
        sum(c.end_ns - c.start_ns) FILTER (WHERE s.state <> 'unknown') AS known_ns,
        count(*) FILTER (WHERE s.state = 'preempted' AND m.is_first AND c.is_begin)
            AS preemption_count,
        count(*) FILTER (WHERE s.state = 'running' AND m.is_migration AND c.is_begin)
            AS migration_count,
        bool_or(s.is_loss_affected) AS is_loss_affected
    FROM staging.callback_state AS c
    JOIN staging.thread_state AS s ON c.state_number = s.number
    JOIN step AS m ON c.state_number = m.number
    GROUP BY c.callback_instance_id
),
-- While a thread of a ROS process had the CPU.
interrupt AS (
    SELECT
        r.number AS state_number,
        i.kind::VARCHAR AS kind,
        i.start_ns + s.shift_ns AS start_ns,
        i.end_ns + s.shift_ns AS end_ns
    FROM raw.interrupt AS i
    JOIN staging.schedule AS s ON i.trace_index = s.trace_index
    JOIN staging.thread_tid AS t ON staging.has_tid(t, s.clock_key, i.tid, i.start_ns + s.shift_ns)
    ASOF JOIN (SELECT * FROM staging.thread_state WHERE state = 'running') AS r
        ON t.thread_id = r.thread_id AND i.start_ns + s.shift_ns >= r.start_ns
    WHERE s.is_joined AND i.kind <> 'timer'
),
handled AS (
    SELECT
        c.callback_instance_id, i.kind,
        least(i.end_ns, c.end_ns) - greatest(i.start_ns, c.start_ns) AS length_ns
    FROM interrupt AS i
    JOIN staging.callback_state AS c ON i.state_number = c.state_number
    WHERE i.end_ns > c.start_ns AND i.start_ns < c.end_ns
),
interrupted AS (
    SELECT
        callback_instance_id,
        sum(length_ns) FILTER (WHERE kind = 'interrupt') AS irq_ns,
        sum(length_ns) FILTER (WHERE kind = 'softirq') AS softirq_ns
    FROM handled
    GROUP BY callback_instance_id
),
recorded AS (
    SELECT
        t.thread_id,
        bool_or(d.name LIKE '%irq_handler_exit') AS has_irq,
        bool_or(d.name LIKE '%softirq_exit') AS has_softirq
    FROM (SELECT DISTINCT thread_id, clock_key FROM staging.thread_tid) AS t
    JOIN staging.schedule AS s ON t.clock_key = s.clock_key
    JOIN staging.declared AS d ON s.trace_index = d.trace_index
    WHERE s.is_joined
    GROUP BY t.thread_id
)
SELECT
    i.callback_instance_id,
    coalesce(COLUMNS([
        'running_ns', 'preempted_ns', 'runnable_ns', 'sleeping_ns', 'uninterruptible_ns'
    ]), 0)::BIGINT,
    (i.end_ns - i.start_ns - coalesce(p.known_ns, 0))::BIGINT AS unknown_ns,
    CASE WHEN r.has_irq THEN coalesce(h.irq_ns, 0)::BIGINT END AS irq_ns,
    CASE WHEN r.has_softirq THEN coalesce(h.softirq_ns, 0)::BIGINT END AS softirq_ns,
    coalesce(p.preemption_count, 0) AS preemption_count,
    coalesce(p.migration_count, 0) AS migration_count,
    coalesce(p.is_loss_affected, false) AS is_loss_affected
FROM staging.callback_extent AS i
JOIN recorded AS r ON i.thread_id = r.thread_id
LEFT JOIN part AS p ON i.callback_instance_id = p.callback_instance_id
LEFT JOIN interrupted AS h ON i.callback_instance_id = h.callback_instance_id
WHERE i.end_ns IS NOT NULL AND i.thread_id IN (SELECT thread_id FROM staging.thread_state)
