-- description: What each thread of a ROS process did, from switch to switch and waking. A waking
--     may come before the switch that it undoes. What the next switch contradicts is not known. A
--     thread that is seen on a CPU without a switch to it got it at some time since its waking.
--     `cpu` is the one that the thread ran on, or left; `next_cpu` the one on which it goes on.
-- grain: one row per interval in which a thread had one state
-- when: staging.thread_switch
WITH extent AS (
    SELECT
        s.clock_key,
        min(w.ts_ns + s.shift_ns) AS start_ns,
        max(w.ts_ns + s.shift_ns) AS end_ns
    FROM raw.sched_switch AS w
    JOIN staging.schedule AS s ON w.trace_index = s.trace_index
    WHERE s.is_joined
    GROUP BY s.clock_key
),
life AS (
    SELECT
        t.thread_id, t.tid,
        greatest(e.start_ns, t.from_ns) AS start_ns,
        least(e.end_ns, t.until_ns) AS end_ns
    FROM staging.thread_tid AS t
    JOIN extent AS e ON t.clock_key = e.clock_key
),
-- Two kernel traces of a host have the same switches.
switch AS (
    SELECT *
    FROM staging.thread_switch
    QUALIFY row_number() OVER (PARTITION BY thread_id, tid, at_ns, is_on ORDER BY event_id) = 1
),
step AS (
    SELECT
        *,
        row_number() OVER thread AS number,
        lead(at_ns) OVER thread AS next_ns,
        lead(is_on) OVER thread AS is_next_on,
        lead(unseen_since_ns) OVER thread AS next_unseen_since_ns,
        lead(cpu) OVER thread AS next_cpu
    FROM switch
    WINDOW thread AS (PARTITION BY thread_id, tid ORDER BY at_ns, event_id)
),
-- A waking while the thread runs is of the switch that follows. Of the same waking in two kernel
-- traces, the one counts whose waker is known.
waking AS (
    SELECT
        k.thread_id, k.tid,
        w.number + CASE WHEN w.is_on THEN 1 ELSE 0 END AS number,
        min_by(k.event_id, (k.at_ns, k.waker_tid IS NULL, k.event_id)) AS event_id,
        min(k.at_ns) AS at_ns
    FROM staging.thread_waking AS k
    ASOF LEFT JOIN step AS w ON k.thread_id = w.thread_id AND k.tid = w.tid AND k.at_ns >= w.at_ns
    GROUP BY ALL
),
placed AS (
    SELECT
        s.*,
        coalesce(s.next_ns, greatest(f.end_ns, s.at_ns)) AS end_ns,
        CASE
            WHEN s.is_on THEN CASE
                WHEN s.is_next_on OR s.next_cpu <> s.cpu THEN 'unknown'
                WHEN s.unseen_since_ns IS NULL AND s.next_unseen_since_ns IS NOT NULL THEN 'unknown'
                ELSE 'running' END
            WHEN NOT s.is_next_on AND s.next_unseen_since_ns IS NULL THEN 'unknown'
            WHEN s.prev_state & 255 = 0
                THEN CASE WHEN s.next_unseen_since_ns IS NULL THEN 'preempted' ELSE 'unknown' END
            -- It ended. 64 means that in old kernels; in others it is parked, and may go on.
            WHEN s.prev_state & 48 <> 0 OR (s.next_ns IS NULL AND s.prev_state & 64 <> 0) THEN NULL
            WHEN s.prev_state & 2 <> 0 THEN 'uninterruptible'
            ELSE 'sleeping'
        END AS state,
        state IN ('sleeping', 'uninterruptible') AS is_asleep,
        CASE WHEN is_asleep THEN k.event_id END AS waking_event_id,
        CASE
            WHEN is_asleep AND coalesce(k.at_ns, s.next_unseen_since_ns) IS NOT NULL
                THEN greatest(coalesce(k.at_ns, s.next_unseen_since_ns), s.at_ns)
        END AS slept_until_ns
    FROM step AS s
    JOIN life AS f ON s.thread_id = f.thread_id AND s.tid = f.tid
    LEFT JOIN waking AS k ON s.thread_id = k.thread_id AND s.tid = k.tid AND s.number = k.number
),
interval AS (
    SELECT
        thread_id, tid, trace_index,
        at_ns AS start_ns,
        coalesce(slept_until_ns, end_ns) AS end_ns,
        state, cpu, next_cpu, priority, waking_event_id
    FROM placed
    WHERE state IS NOT NULL
    UNION ALL
    SELECT
        thread_id, tid, trace_index, slept_until_ns, end_ns,
        CASE WHEN next_unseen_since_ns IS NULL THEN 'runnable' ELSE 'unknown' END,
        cpu, next_cpu, priority, waking_event_id
    FROM placed
    WHERE slept_until_ns IS NOT NULL
    UNION ALL
    -- What was before the first switch.
    SELECT
        s.thread_id, s.tid, s.trace_index,
        CASE
            WHEN s.is_on OR s.unseen_since_ns IS NOT NULL THEN coalesce(k.at_ns, s.unseen_since_ns)
            ELSE f.start_ns
        END,
        s.at_ns,
        CASE
            WHEN s.unseen_since_ns IS NOT NULL THEN 'unknown'
            WHEN s.is_on THEN 'runnable'
            ELSE 'running'
        END,
        s.cpu, s.cpu, s.priority,
        CASE WHEN s.is_on THEN k.event_id END
    FROM step AS s
    JOIN life AS f ON s.thread_id = f.thread_id AND s.tid = f.tid
    LEFT JOIN waking AS k ON s.thread_id = k.thread_id AND s.tid = k.tid AND k.number IS NULL
    WHERE s.number = 1
)
SELECT
    thread_id, tid, start_ns, end_ns, state, trace_index, cpu, next_cpu, priority, waking_event_id
FROM interval
WHERE end_ns > start_ns
