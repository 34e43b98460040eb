-- name: staging.schedule_other
-- kind: inline
-- description: Threads that had the CPU for which a thread of a ROS process waited, or woke it.
-- grain: one row per such moment and tid
SELECT clock_key, tid, name, start_ns AS at_ns FROM staging.cpu_taken
UNION ALL
SELECT w.clock_key, w.waker_tid, w.waker_name, w.at_ns
FROM staging.thread_waking AS w
WHERE w.waker_tid IS NOT NULL
    AND w.event_id IN (SELECT waking_event_id FROM staging.schedule_interval)
