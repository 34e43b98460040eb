-- kind: inline
-- description: What executors say of themselves, with what they said before on the same thread.
--     These are most of the events of many traces, which is why they are not copied.
-- grain: one row per executor event
WITH event AS (
    SELECT
        *,
        'process' AS kind
    FROM raw.ros2_rclcpp_executor_get_next_ready
    UNION ALL BY NAME
    SELECT
        *,
        'wait' AS kind
    FROM raw.ros2_rclcpp_executor_wait_for_work
    UNION ALL BY NAME
    SELECT
        *,
        'execute' AS kind
    FROM raw.ros2_rclcpp_executor_execute
)
SELECT
    event_id, ts_ns, process_id, thread_id, kind, timeout,
    previous_executor_event_id AS previous_event_id,
    previous_executor_ts_ns AS previous_ns,
    previous_executor_label AS previous_kind
FROM staging.located('event')
