-- description: Callback objects whose creation was traced, with what they belong to, each by the
--     event that initialised it. A callback that was only registered has a symbol but no owner; a
--     function of Python never has one. A service that was not seen to be initialised is known by
--     its handle.
-- grain: one row per callback object
-- when: raw.ros2_rclcpp_subscription_callback_added, raw.ros2_rclcpp_timer_callback_added,
--     raw.ros2_rclcpp_service_callback_added, raw.ros2_rclcpp_callback_register
WITH added AS (
    SELECT
        a.event_id, a.ts_ns, a.process_id, a.callback, 'subscription' AS kind,
        o.subscription_event_id, NULL::BIGINT AS timer_event_id,
        NULL::BIGINT AS service_event_id, NULL::UBIGINT AS service_handle
    FROM staging.located('ros2_rclcpp_subscription_callback_added') AS a
    LEFT JOIN staging.subscription_object AS o ON a.event_id = o.event_id
    UNION ALL
    SELECT
        a.event_id, a.ts_ns, a.process_id, a.callback, 'timer', NULL, u.timer_event_id, NULL, NULL
    FROM staging.located('ros2_rclcpp_timer_callback_added') AS a
    JOIN staging.timer_use AS u ON a.event_id = u.event_id AND u.has_callback
    UNION ALL
    SELECT
        a.event_id, a.ts_ns, a.process_id, a.callback, 'service', NULL, NULL,
        coalesce(l.service_event_id, s.event_id), a.service_handle
    FROM staging.located('ros2_rclcpp_service_callback_added') AS a
    LEFT JOIN staging.lifecycle_service AS l ON a.event_id = l.event_id
    ASOF LEFT JOIN staging.service_known AS s
        ON a.process_id = s.process_id
        AND a.service_handle = s.service_handle
        AND a.event_id >= s.event_id
),
registered AS (
    SELECT
        r.event_id, r.ts_ns, r.process_id, r.callback,
        CASE
            WHEN r.symbol NOT IN ('', 'UNKNOWN', 'UNKNOWN_demangling_failed', '(null)')
                THEN replace(r.symbol, '#msgflow function ', '')
        END AS symbol,
        CASE WHEN r.symbol LIKE '#msgflow %' THEN 'function' ELSE 'unknown' END AS kind,
        a.event_id AS added_event_id
    FROM staging.located('ros2_rclcpp_callback_register') AS r
    ASOF LEFT JOIN added AS a
        ON r.process_id = a.process_id AND r.callback = a.callback AND r.event_id >= a.event_id
    WHERE r.symbol NOT LIKE '#msgflow %' OR r.symbol LIKE '#msgflow function %'
),
symbol_of AS (
    SELECT added_event_id, arg_min(symbol, event_id) AS symbol
    FROM registered
    WHERE added_event_id IS NOT NULL
    GROUP BY added_event_id
)
SELECT
    a.event_id, a.ts_ns AS created_ns, a.process_id, a.callback AS callback_handle, a.kind,
    a.subscription_event_id, a.timer_event_id, a.service_event_id, a.service_handle, s.symbol
FROM added AS a
LEFT JOIN symbol_of AS s ON a.event_id = s.added_event_id
UNION ALL
SELECT event_id, ts_ns, process_id, callback, kind, NULL, NULL, NULL, NULL, symbol
FROM registered
WHERE added_event_id IS NULL
