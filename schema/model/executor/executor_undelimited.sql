-- description: Threads whose executor states have no begin or no end: the recording leaves out one
--     of the two events between which executors wait, so another state would seem to last.
-- grain: one row per thread with executor events
-- when: staging.executor_first
SELECT f.thread_id, t.process_id
FROM staging.executor_first AS f
JOIN staging.thread AS t ON f.thread_id = t.thread_id
WHERE NOT EXISTS (FROM raw.ros2_rclcpp_executor_wait_for_work)
    OR NOT EXISTS (FROM raw.ros2_rclcpp_executor_get_next_ready)
