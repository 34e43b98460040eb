-- description: Executor events directly before callback instances without a known owner. The
--     creation of such a callback was not traced, and no message or request was ever seen to be for
--     it. The executor names the handle that it executes, if that is a timer or a subscription.
--     Else it only looks for what is ready. Where another event comes in between, it is neither.
-- grain: one row per such callback instance that an executor event precedes in the trace
-- when: staging.callback_binding WHERE coalesce(kind = 'unknown', true)
WITH unowned AS (
    SELECT start_event_id, process_id, callback_handle, callback_event_id, is_intra_process,
        take_event_id, request_event_id
    FROM staging.callback_binding
    WHERE coalesce(kind = 'unknown', true)
),
explained AS (
    SELECT DISTINCT process_id, callback_handle, callback_event_id
    FROM unowned
    WHERE is_intra_process OR take_event_id IS NOT NULL OR request_event_id IS NOT NULL
),
run AS (
    SELECT
        u.start_event_id, u.process_id, u.callback_handle, u.callback_event_id, p.trace_index,
        p.thread_id, p.executor_event_id,
        coalesce(p.previous_event_id < p.executor_event_id, true) AS is_direct
    FROM unowned AS u
    ANTI JOIN explained AS e
        ON u.process_id = e.process_id
        AND u.callback_handle = e.callback_handle
        AND u.callback_event_id IS NOT DISTINCT FROM e.callback_event_id
    JOIN staging.callback_pair AS p ON u.start_event_id = p.start_event_id
    WHERE p.executor_event_id IS NOT NULL
),
named AS (
    SELECT r.start_event_id, x.handle
    FROM run AS r
    JOIN raw.ros2_rclcpp_executor_execute AS x ON r.executor_event_id = x.event_id
    WHERE r.is_direct
),
ready AS (
    SELECT r.start_event_id
    FROM run AS r
    JOIN raw.ros2_rclcpp_executor_get_next_ready AS x ON r.executor_event_id = x.event_id
    WHERE r.is_direct
)
SELECT
    r.start_event_id, r.process_id, r.callback_handle, r.callback_event_id, r.trace_index,
    r.thread_id, n.handle, y.start_event_id IS NOT NULL AS is_ready
FROM run AS r
LEFT JOIN named AS n ON r.start_event_id = n.start_event_id
LEFT JOIN ready AS y ON r.start_event_id = y.start_event_id
