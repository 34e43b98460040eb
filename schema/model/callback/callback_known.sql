-- description: Callback objects whose creation was traced, with what they belong to, each by the
--     event that initialised it. A callback that was only registered has a symbol but no owner; a
--     function of Python never has one. A service that was not seen to be initialised is known by
--     its handle.
-- grain: one row per callback object
-- when: raw.ros2_rclcpp_subscription_callback_added, raw.ros2_rclcpp_timer_callback_added,
--     raw.ros2_rclcpp_service_callback_added, raw.ros2_rclcpp_callback_register

-- Services of managed nodes, by the callbacks that were added to them. The state machine of such a
-- node initialises its services, and rclcpp_lifecycle gives rclcpp copies of them. So the handles
-- that the callbacks are added to are initialised nowhere. Order tells: the services come right
-- before the state machine on the thread, then in the same order the callbacks, before the thread
-- initialises another service. Where one of these is missing, the order tells nothing.
-- when: raw.ros2_rcl_lifecycle_state_machine_init
-- columns: event_id BIGINT, service_event_id BIGINT
CREATE OR REPLACE TEMP TABLE lifecycle_service AS
WITH initialised AS (
    SELECT event_id, thread_id, process_id, node_handle, service_handle
    FROM staging.located('raw.ros2_rcl_service_init')
),
machine AS (
    SELECT event_id, thread_id, node_handle
    FROM staging.located('raw.ros2_rcl_lifecycle_state_machine_init')
),
-- A service of rclcpp has its callback before the thread initialises the next.
added AS (
    SELECT
        a.event_id, a.thread_id,
        i.event_id AS init_event_id,
        a.service_handle = i.service_handle AS is_own
    FROM staging.located('raw.ros2_rclcpp_service_callback_added') AS a
    ASOF JOIN initialised AS i ON a.thread_id = i.thread_id AND a.event_id >= i.event_id
),
service AS (
    SELECT
        m.event_id AS machine_event_id,
        i.event_id
    FROM initialised AS i
    ANTI JOIN (FROM added WHERE is_own) AS a ON i.event_id = a.init_event_id
    ASOF JOIN machine AS m
        ON i.thread_id = m.thread_id AND i.node_handle = m.node_handle AND i.event_id <= m.event_id
),
callback AS (
    SELECT
        m.event_id AS machine_event_id,
        a.event_id
    FROM added AS a
    ASOF JOIN machine AS m ON a.thread_id = m.thread_id AND a.event_id >= m.event_id
    WHERE a.init_event_id < m.event_id
),
numbered AS (
    SELECT
        machine_event_id, event_id, kind,
        row_number() OVER (PARTITION BY machine_event_id, kind ORDER BY event_id) AS position,
        count(*) OVER (PARTITION BY machine_event_id, kind) AS number
    FROM (
        SELECT
            machine_event_id, event_id,
            'service' AS kind
        FROM service
        UNION ALL
        SELECT machine_event_id, event_id, 'callback'
        FROM callback
    )
)
SELECT
    c.event_id,
    s.event_id AS service_event_id
FROM numbered AS c
JOIN numbered AS s
    ON c.machine_event_id = s.machine_event_id AND c.position = s.position AND c.number = s.number
WHERE c.kind = 'callback'
    AND s.kind = 'service'
    -- rcl_lifecycle makes five: to change state, and four to ask for what there is.
    AND c.number = 5;

WITH added AS (
    SELECT
        a.event_id, a.ts_ns, a.process_id, a.callback,
        'subscription' AS kind,
        o.subscription_event_id,
        NULL::BIGINT AS timer_event_id,
        NULL::BIGINT AS service_event_id,
        NULL::UBIGINT AS service_handle
    FROM staging.located('raw.ros2_rclcpp_subscription_callback_added') AS a
    LEFT JOIN staging.subscription_object AS o ON a.event_id = o.event_id
    UNION ALL
    SELECT
        a.event_id, a.ts_ns, a.process_id, a.callback, 'timer', NULL, u.timer_event_id, NULL, NULL
    FROM staging.located('raw.ros2_rclcpp_timer_callback_added') AS a
    JOIN staging.timer_use AS u ON a.event_id = u.event_id AND u.has_callback
    UNION ALL
    SELECT
        a.event_id, a.ts_ns, a.process_id, a.callback, 'service', NULL, NULL,
        coalesce(l.service_event_id, s.event_id),
        a.service_handle
    FROM staging.located('raw.ros2_rclcpp_service_callback_added') AS a
    LEFT JOIN lifecycle_service AS l ON a.event_id = l.event_id
    ASOF LEFT JOIN staging.located('raw.ros2_rcl_service_init') AS s
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
    FROM staging.located('raw.ros2_rclcpp_callback_register') AS r
    ASOF LEFT JOIN added AS a
        ON r.process_id = a.process_id AND r.callback = a.callback AND r.event_id >= a.event_id
    WHERE r.symbol NOT LIKE '#msgflow %' OR r.symbol LIKE '#msgflow function %'
),
symbol_of AS (
    SELECT
        added_event_id,
        arg_min(symbol, event_id) AS symbol
    FROM registered
    WHERE added_event_id IS NOT NULL
    GROUP BY added_event_id
)
SELECT
    a.event_id,
    a.ts_ns AS created_ns,
    a.process_id,
    a.callback AS callback_handle,
    a.kind, a.subscription_event_id, a.timer_event_id, a.service_event_id, a.service_handle,
    s.symbol
FROM added AS a
LEFT JOIN symbol_of AS s ON a.event_id = s.added_event_id
UNION ALL
SELECT event_id, ts_ns, process_id, callback, kind, NULL, NULL, NULL, NULL, symbol
FROM registered
WHERE added_event_id IS NULL
