-- description: Threads that poll their executor (spin_some): most of their waits have a timeout of
--     0. How many, and of how many.
-- grain: one row per thread
-- when: raw.ros2_rclcpp_executor_wait_for_work
WITH waited AS (
    SELECT
        thread_index, min(event_id) AS event_id, count(*) FILTER (WHERE timeout = 0) AS polls,
        count(*) AS waits
    FROM raw.ros2_rclcpp_executor_wait_for_work
    GROUP BY thread_index
)
SELECT c.thread_id, c.process_id, w.polls, w.waits
FROM waited AS w
JOIN staging.thread AS c
    ON w.thread_index = c.thread_index
    AND w.event_id >= c.from_event_id
    AND w.event_id < c.until_event_id
-- Any program may poll once before it spins.
WHERE w.polls > 1 AND 2 * w.polls > w.waits
