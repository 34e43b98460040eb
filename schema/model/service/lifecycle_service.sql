-- description: Services of managed nodes, by the callbacks that were added to them. The state
--     machine of such a node initialises its services, and rclcpp_lifecycle gives rclcpp copies of
--     them. So the handles that the callbacks are added to are initialised nowhere. Order tells:
--     the services come right before the state machine on the thread, then in the same order the
--     callbacks, before the thread initialises another service. Where one of these is missing, the
--     order tells nothing.
-- grain: one row per rclcpp_service_callback_added of such a service
-- when: raw.ros2_rcl_lifecycle_state_machine_init
WITH initialised AS (
    SELECT event_id, thread_id, process_id, node_handle, service_handle
    FROM staging.located('ros2_rcl_service_init')
),
machine AS (
    SELECT event_id, thread_id, node_handle
    FROM staging.located('ros2_rcl_lifecycle_state_machine_init')
),
-- A service of rclcpp has its callback before the thread initialises the next.
added AS (
    SELECT
        a.event_id, a.thread_id, i.event_id AS init_event_id,
        a.service_handle = i.service_handle AS is_own
    FROM staging.located('ros2_rclcpp_service_callback_added') AS a
    ASOF JOIN initialised AS i ON a.thread_id = i.thread_id AND a.event_id >= i.event_id
),
service AS (
    SELECT m.event_id AS machine_event_id, i.event_id
    FROM initialised AS i
    ANTI JOIN (FROM added WHERE is_own) AS a ON i.event_id = a.init_event_id
    ASOF JOIN machine AS m
        ON i.thread_id = m.thread_id AND i.node_handle = m.node_handle AND i.event_id <= m.event_id
),
callback AS (
    SELECT m.event_id AS machine_event_id, a.event_id
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
        SELECT machine_event_id, event_id, 'service' AS kind FROM service
        UNION ALL
        SELECT machine_event_id, event_id, 'callback' FROM callback
    )
)
SELECT c.event_id, s.event_id AS service_event_id
FROM numbered AS c
JOIN numbered AS s
    ON c.machine_event_id = s.machine_event_id AND c.position = s.position AND c.number = s.number
WHERE c.kind = 'callback'
    AND s.kind = 'service'
    -- rcl_lifecycle makes five: to change state, and four to ask for what there is.
    AND c.number = 5
