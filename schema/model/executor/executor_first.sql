-- description: Where the executor of each thread is first heard of, how often it waited, and how
--     often of these with a timeout of 0. `is_undelimited`: the recording leaves out one of the two
--     events between which executors wait, so another state would seem to last.
-- grain: one row per thread with executor events
-- when: raw.ros2_rclcpp_executor_get_next_ready, raw.ros2_rclcpp_executor_wait_for_work,
--     raw.ros2_rclcpp_executor_execute
SELECT
    thread_id, process_id,
    min(event_id) AS event_id,
    count(*) FILTER (kind = 'wait') AS waits,
    count(*) FILTER (timeout = 0) AS polls,
    sum(count(*) FILTER (kind = 'wait')) OVER () = 0
    OR sum(count(*) FILTER (kind = 'process')) OVER () = 0 AS is_undelimited
FROM staging.executor_event
GROUP BY thread_id, process_id
