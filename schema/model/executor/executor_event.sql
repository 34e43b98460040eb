-- kind: inline
-- description: What executors say of themselves, with what they said before on the same thread;
--     before `from_event_id` that was another life of the process. These are most of the events of
--     many traces, which is why they are not copied.
-- grain: one row per executor event
WITH event AS (
    SELECT
        event_id, ts_ns, thread_index, 'process' AS kind, previous_executor_event_id,
        previous_executor_ts_ns, previous_executor_label
    FROM raw.ros2_rclcpp_executor_get_next_ready
    UNION ALL
    SELECT
        event_id, ts_ns, thread_index, 'wait', previous_executor_event_id,
        previous_executor_ts_ns, previous_executor_label
    FROM raw.ros2_rclcpp_executor_wait_for_work
    UNION ALL
    SELECT
        event_id, ts_ns, thread_index, 'execute', previous_executor_event_id,
        previous_executor_ts_ns, previous_executor_label
    FROM raw.ros2_rclcpp_executor_execute
)
SELECT
    e.event_id, e.ts_ns, c.thread_id, e.kind, e.previous_executor_event_id AS previous_event_id,
    e.previous_executor_ts_ns AS previous_ns, e.previous_executor_label AS previous_kind,
    c.from_event_id
FROM event AS e
JOIN staging.thread AS c
    ON e.thread_index = c.thread_index
    AND e.event_id >= c.from_event_id
    AND e.event_id < c.until_event_id
