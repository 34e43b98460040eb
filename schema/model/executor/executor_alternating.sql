-- description: Threads of one executor that its lock shows: the threads of a process take turns in
--     waiting for work, and no two of them ever wait at once. Threads of several executors do.
-- grain: one row per such thread
-- when: raw.ros2_rclcpp_executor_wait_for_work
WITH spinning AS (
    SELECT f.thread_id, t.process_id, f.event_id
    FROM staging.executor_first AS f
    JOIN staging.thread AS t ON f.thread_id = t.thread_id
),
several AS (
    SELECT process_id, min(event_id) AS first_event_id
    FROM spinning
    GROUP BY process_id
    HAVING count(*) > 1
),
turn AS (
    SELECT
        s.process_id,
        e.thread_id <> lag(e.thread_id) OVER in_process AS is_other,
        sum((e.kind = 'wait')::INTEGER - coalesce(e.previous_kind = 'wait', false)::INTEGER)
            OVER in_process AS waiting
    FROM staging.executor_event AS e
    JOIN spinning AS s ON e.thread_id = s.thread_id
    WHERE s.process_id IN (SELECT process_id FROM several)
    WINDOW in_process AS (PARTITION BY s.process_id ORDER BY e.event_id)
)
SELECT s.thread_id, p.first_event_id
FROM spinning AS s
JOIN several AS p ON s.process_id = p.process_id
WHERE s.process_id IN (
    -- Ten turns: once, one may have begun when another had ended.
    SELECT process_id
    FROM turn
    GROUP BY process_id
    HAVING max(waiting) = 1 AND count(*) FILTER (WHERE is_other) >= 10
)
