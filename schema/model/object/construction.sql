-- name: staging.construction
-- description: Nodes and what names one, and whether a publisher was created inside its node, right
--     before the node's own event: before Jazzy /rosout is. Where a node handle is used again, what
--     came first on the handle tells the two orders apart.
-- grain: one row per initialisation event that names a node
-- when: raw.ros2_rcl_node_init, raw.ros2_rcl_publisher_init, raw.ros2_rcl_subscription_init,
--     raw.ros2_rcl_service_init, raw.ros2_rcl_client_init, raw.ros2_rclcpp_timer_link_node,
--     raw.ros2_rcl_lifecycle_state_machine_init
WITH initialisation AS (
    SELECT event_id, process_id, thread_id, 'node' AS kind, node_handle
    FROM staging.located('ros2_rcl_node_init')
    UNION ALL
    SELECT event_id, process_id, thread_id, 'publisher', node_handle
    FROM staging.located('ros2_rcl_publisher_init')
    UNION ALL
    SELECT event_id, process_id, thread_id, 'subscription', node_handle
    FROM staging.located('ros2_rcl_subscription_init')
    UNION ALL
    SELECT event_id, process_id, thread_id, 'service', node_handle
    FROM staging.located('ros2_rcl_service_init')
    UNION ALL
    SELECT event_id, process_id, thread_id, 'client', node_handle
    FROM staging.located('ros2_rcl_client_init')
    UNION ALL
    SELECT event_id, process_id, thread_id, 'timer', node_handle
    FROM staging.located('ros2_rclcpp_timer_link_node')
    UNION ALL
    SELECT event_id, process_id, thread_id, 'lifecycle', node_handle
    FROM staging.located('ros2_rcl_lifecycle_state_machine_init')
)
SELECT
    event_id, process_id, kind, node_handle,
    kind = 'publisher'
    AND lead(kind) OVER on_thread = 'node'
    AND lead(node_handle) OVER on_thread = node_handle
    AND first_value(kind) OVER of_handle <> 'node' AS precedes_own_node
FROM initialisation
WINDOW
    on_thread AS (PARTITION BY thread_id ORDER BY event_id),
    of_handle AS (PARTITION BY process_id, node_handle ORDER BY event_id)
