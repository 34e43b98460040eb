-- description: Which timer each event means that names an rcl timer handle: the one initialised
--     last before, else a placeholder by the first use of the handle.
-- grain: one row per event that attaches a callback (`has_callback`) or a node to a timer; an event
--     of Agnocast attaches both
-- when: raw.ros2_rclcpp_timer_callback_added, raw.ros2_rclcpp_timer_link_node
WITH use AS (
    SELECT
        event_id, process_id, timer_handle,
        true AS has_callback
    FROM staging.located('raw.ros2_rclcpp_timer_callback_added')
    UNION ALL
    SELECT event_id, process_id, timer_handle, false
    FROM staging.located('raw.ros2_rclcpp_timer_link_node')
),
resolved AS (
    SELECT
        u.event_id, u.process_id, u.timer_handle, u.has_callback,
        i.event_id AS known_event_id
    FROM use AS u
    ASOF LEFT JOIN staging.located('raw.ros2_rcl_timer_init') AS i
        ON u.process_id = i.process_id
        AND u.timer_handle = i.timer_handle
        AND u.event_id >= i.event_id
)
SELECT
    event_id, process_id, timer_handle,
    coalesce(
        known_event_id,
        min(CASE WHEN known_event_id IS NULL THEN event_id END) OVER (
            PARTITION BY process_id, timer_handle
        )
    ) AS timer_event_id,
    known_event_id IS NULL AS is_inferred,
    has_callback
FROM resolved
