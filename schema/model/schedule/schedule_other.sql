-- name: staging.schedule_other
-- kind: inline
-- description: Threads that took a CPU from a thread of a ROS process, or woke it.
-- grain: one row per such moment and tid
SELECT t.clock_key, i.other_tid AS tid, i.other_name AS name, i.start_ns AS at_ns
FROM staging.schedule_interval AS i
JOIN (SELECT DISTINCT thread_id, clock_key FROM staging.thread_tid) AS t
    ON i.thread_id = t.thread_id
WHERE i.other_tid IS NOT NULL
UNION ALL
SELECT w.clock_key, w.waker_tid, w.waker_name, w.at_ns
FROM staging.thread_waking AS w
WHERE w.waker_tid IS NOT NULL
    AND w.event_id IN (SELECT waking_event_id FROM staging.schedule_interval)
