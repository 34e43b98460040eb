-- description: When ROS threads woke the middleware's threads that wake the threads of events
--     executors: how messages come to their process while these run. By their names, these are
--     threads of the middleware.
-- grain: one row per waking of such a thread by a thread of a ROS process
-- when: staging.executor WHERE kind = 'events'
WITH receiver AS (
    SELECT DISTINCT t.process_id, w.clock_key, w.waker_tid AS tid
    FROM staging.thread_waking AS w
    JOIN staging.thread AS t ON w.thread_id = t.thread_id
    JOIN staging.executor_thread AS x ON t.thread_id = x.thread_id
    JOIN staging.executor AS e ON x.executor_id = e.executor_id
    WHERE e.kind = 'events' AND regexp_matches(w.waker_name, '^(dds\.|recv|dq\.)')
)
SELECT r.process_id, p.thread_id AS waker_thread_id, k.ts_ns + s.shift_ns AS at_ns
FROM raw.sched_waking AS k
JOIN staging.schedule AS s ON k.trace_index = s.trace_index
JOIN receiver AS r ON s.clock_key = r.clock_key AND k.tid = r.tid
JOIN raw.sched_switch AS w ON k.switch_event_id = w.event_id
JOIN staging.thread_tid AS p ON staging.has_tid(p, s.clock_key, w.next_tid, k.ts_ns + s.shift_ns)
WHERE s.is_joined AND k.interrupt IS NULL
