-- description: Callbacks without a known owner, if the executor said the same before each of their
--     instances: the handle that it named (NULL if it named none), the timer or subscription of
--     that handle if the trace has it, and which tracepoints were enabled meanwhile.
-- grain: one row per such callback
-- when: staging.callback_owner_trigger
WITH enabled AS (
    SELECT
        trace_index,
        bool_or(name IN ('ros2:rmw_take', 'ros2:rcl_take')) AS has_takes,
        bool_or(name = 'ros2:rclcpp_executor_execute') AS has_executions,
        bool_or(name = 'ros2:rmw_take_request') AS has_requests
    FROM staging.declared
    GROUP BY trace_index
),
agreed AS (
    SELECT
        t.process_id, t.callback_handle, t.callback_event_id, any_value(t.handle) AS handle,
        min(t.start_event_id) AS start_event_id, bool_and(e.has_takes) AS has_takes,
        bool_and(e.has_executions) AS has_executions, bool_or(e.has_requests) AS has_requests
    FROM staging.callback_owner_trigger AS t
    LEFT JOIN enabled AS e ON t.trace_index = e.trace_index
    GROUP BY t.process_id, t.callback_handle, t.callback_event_id
    HAVING sum(t.is_ready::INTEGER) = count(*)
        OR (count(t.handle) = count(*) AND count(DISTINCT t.handle) = 1)
),
owner AS (
    SELECT event_id, process_id, timer_handle AS handle, 'timer' AS kind, event_id AS owner_event_id
    FROM staging.located('ros2_rcl_timer_init')
    UNION ALL
    SELECT event_id, process_id, subscription_handle, 'subscription', event_id
    FROM staging.subscription_known
    UNION ALL
    SELECT 0, process_id, any_value(timer_handle), 'timer', timer_event_id
    FROM staging.timer_use
    WHERE is_inferred
    GROUP BY process_id, timer_event_id
)
SELECT
    a.process_id, a.callback_handle, a.callback_event_id, a.handle, a.start_event_id,
    a.has_takes, a.has_executions, a.has_requests, o.kind, o.owner_event_id,
    a.handle IS NOT NULL
    AND count(*) OVER (PARTITION BY a.process_id, a.handle, o.owner_event_id) > 1 AS is_disputed
FROM agreed AS a
ASOF LEFT JOIN owner AS o
    ON a.process_id = o.process_id AND a.handle = o.handle AND a.start_event_id >= o.event_id
