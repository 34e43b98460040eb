-- name: staging.schedule
-- description: The clock of each kernel trace: the one by which most events of ROS processes
--     happened while the kernel says that their thread ran on their CPU. A thread has one number
--     until its process initialises ROS again, and no other thread has that: any other one counts
--     as contradiction. Where the kernel trace contradicts itself, events do not count. With the
--     right clock all events agree; 5 us beside it 2 to 47 % do not.
-- grain: one row per kernel trace with switches
-- when: staging.schedule_candidate
-- column: trace_index INTEGER  The kernel trace
-- column: clock_key VARCHAR  Its clock, or the best of those it may be of
-- column: shift_ns BIGINT [ns]  What has to be added to its times
-- column: event_count BIGINT  Events of ROS processes at which it says what ran on their CPU
-- column: agreeing_count BIGINT  Those that agree with it
-- column: unknown_count BIGINT  Events at which it contradicts itself
-- column: is_joined BOOLEAN  It is of that clock
-- column: has_cpus BOOLEAN  It says on which CPU a switch was
WITH initialisation AS (
    SELECT t.trace_index, t.pid_ns, t.vpid, i.event_id
    FROM raw.ros2_rcl_init AS i
    JOIN raw.thread AS t ON i.thread_index = t.thread_index
),
thread AS (
    SELECT thread_index, trace_index, coalesce(pid_ns, 0) AS pid_ns, vpid, vtid FROM raw.thread
),
ran AS (
    SELECT
        m.trace_index, m.clock_key, m.shift_ns, m.thread_index, t.vpid, t.vtid,
        i.event_id AS life, m.tid,
        count(*) FILTER (WHERE m.contradiction_id IS NULL) AS event_count,
        count(m.contradiction_id) AS unknown_count
    FROM staging.schedule_moment AS m
    JOIN thread AS t ON m.thread_index = t.thread_index
    ASOF LEFT JOIN initialisation AS i
        ON t.vpid = i.vpid
        AND t.trace_index = i.trace_index
        AND t.pid_ns = coalesce(i.pid_ns, 0)
        AND m.event_id >= i.event_id
    GROUP BY ALL
),
-- The thread of each number: a trace of a process has an index of its own for the same thread.
owner AS (
    SELECT
        trace_index, clock_key, shift_ns, tid, arg_max((vpid, vtid), event_count) AS ids
    FROM (
        SELECT
            trace_index, clock_key, shift_ns, tid, vpid, vtid, sum(event_count) AS event_count
        FROM ran
        WHERE tid <> 0
        GROUP BY ALL
    )
    GROUP BY ALL
),
most AS (
    SELECT
        r.trace_index, r.clock_key, r.shift_ns, sum(r.event_count) AS event_count,
        coalesce(max(r.event_count) FILTER (WHERE o.ids = (r.vpid, r.vtid)), 0) AS agreeing_count,
        sum(r.unknown_count) AS unknown_count
    FROM ran AS r
    LEFT JOIN owner AS o USING (trace_index, clock_key, shift_ns, tid)
    GROUP BY r.trace_index, r.clock_key, r.shift_ns, r.thread_index, r.life
),
agreement AS (
    SELECT
        trace_index, clock_key, shift_ns,
        sum(event_count)::BIGINT AS event_count, sum(agreeing_count)::BIGINT AS agreeing_count,
        sum(unknown_count)::BIGINT AS unknown_count
    FROM most
    GROUP BY ALL
)
SELECT
    c.trace_index,
    c.clock_key,
    c.shift_ns,
    coalesce(a.event_count, 0) AS event_count,
    coalesce(a.agreeing_count, 0) AS agreeing_count,
    coalesce(a.unknown_count, 0) AS unknown_count,
    coalesce(a.event_count > 0 AND a.agreeing_count >= 0.95 * a.event_count, false) AS is_joined,
    c.has_cpus
FROM staging.schedule_candidate AS c
LEFT JOIN agreement AS a USING (trace_index, clock_key, shift_ns)
QUALIFY row_number() OVER (
    PARTITION BY c.trace_index
    ORDER BY a.agreeing_count / nullif(a.event_count, 0) DESC NULLS LAST, c.clock_key, abs(c.shift_ns)
) = 1
