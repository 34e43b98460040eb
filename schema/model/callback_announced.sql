-- name: staging.callback_announced
-- description: Callbacks without a known owner of which the executor said the same before every
--     run, with the timer or subscription that the handle means, if the trace names it. Without
--     a handle (NULL) the executor named none.
-- grain: one row per such callback
-- needs: staging.callback_trigger, staging.located, staging.subscription_known, staging.timer_use
WITH agreed AS (
    SELECT
        process_id, callback_handle, callback_event_id, any_value(handle) AS handle,
        min(start_event_id) AS start_event_id, min(trace_index) AS trace_index
    FROM staging.callback_trigger
    GROUP BY process_id, callback_handle, callback_event_id
    HAVING sum(is_ready::INTEGER) = count(*)
        OR (count(handle) = count(*) AND count(DISTINCT handle) = 1)
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
    a.trace_index, o.kind, o.owner_event_id,
    a.handle IS NOT NULL
    AND count(*) OVER (PARTITION BY a.process_id, a.handle, o.owner_event_id) > 1 AS is_disputed
FROM agreed AS a
ASOF LEFT JOIN owner AS o
    ON a.process_id = o.process_id
    AND a.handle = o.handle
    AND a.start_event_id >= o.event_id
