-- name: staging.executor_event
-- description: What executors say of themselves. These are most of the events of many traces, which
--     is why they are kept apart from what threads do besides.
-- grain: one row per executor event
-- needs: staging.context, raw
WITH executor AS (
    SELECT event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid, 'process' AS kind
    FROM raw.ros2_rclcpp_executor_get_next_ready
    UNION ALL
    SELECT event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid, 'wait'
    FROM raw.ros2_rclcpp_executor_wait_for_work
    UNION ALL
    SELECT event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid, 'execute'
    FROM raw.ros2_rclcpp_executor_execute
)
SELECT
    x.event_id,
    x.ts_ns,
    x.trace_index,
    x.cpu_id,
    c.thread_id,
    x.kind::ENUM('process', 'wait', 'execute') AS kind
FROM executor AS x
JOIN staging.context AS c
    ON x.trace_index = c.trace_index
    AND x.vpid = c.vpid
    AND x.vtid = c.vtid
    AND x.pid_ns IS NOT DISTINCT FROM c.pid_ns
    AND x.event_id >= c.from_event_id
    AND x.event_id < c.until_event_id
