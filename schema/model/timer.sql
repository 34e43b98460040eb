-- name: staging.timer
-- description: Timers. The node is linked after the timer was made (since Galactic).
-- grain: one row per timer
-- needs: staging.located, staging.object_node
WITH link AS (
    SELECT l.event_id, l.process_id, l.timer_handle, n.node_id
    FROM staging.located('ros2_rclcpp_timer_link_node') AS l
    LEFT JOIN staging.object_node AS n ON l.event_id = n.event_id
),
initialised AS (
    SELECT event_id, process_id, timer_handle, period AS period_ns, ts_ns AS created_ns
    FROM staging.located('ros2_rcl_timer_init')
),
linked AS (
    SELECT i.event_id, min(l.node_id) AS node_id
    FROM link AS l
    ASOF JOIN initialised AS i
        ON l.process_id = i.process_id
        AND l.timer_handle = i.timer_handle
        AND l.event_id >= i.event_id
    GROUP BY i.event_id
)
SELECT
    row_number() OVER (ORDER BY i.event_id) AS timer_id,
    i.process_id, l.node_id, i.period_ns, i.timer_handle, i.created_ns, i.event_id
FROM initialised AS i
LEFT JOIN linked AS l ON i.event_id = l.event_id
