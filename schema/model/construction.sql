-- name: staging.construction
-- description: Initialisation events with the next one on their thread: the /rosout publisher may
--     be created inside its node, right before the node's own event.
-- grain: one row per initialisation event that names a node
-- needs: staging.located
WITH initialisation AS (
    SELECT event_id, thread_id, 'node' AS kind, node_handle
    FROM staging.located('ros2_rcl_node_init')
    UNION ALL
    SELECT event_id, thread_id, 'publisher', node_handle
    FROM staging.located('ros2_rcl_publisher_init')
    UNION ALL
    SELECT event_id, thread_id, 'subscription', node_handle
    FROM staging.located('ros2_rcl_subscription_init')
    UNION ALL
    SELECT event_id, thread_id, 'service', node_handle
    FROM staging.located('ros2_rcl_service_init')
    UNION ALL
    SELECT event_id, thread_id, 'client', node_handle
    FROM staging.located('ros2_rcl_client_init')
    UNION ALL
    SELECT event_id, thread_id, 'timer', node_handle
    FROM staging.located('ros2_rclcpp_timer_link_node')
    UNION ALL
    SELECT event_id, thread_id, 'lifecycle', node_handle
    FROM staging.located('ros2_rcl_lifecycle_state_machine_init')
)
SELECT
    event_id,
    lead(kind) OVER on_thread = 'node'
    AND lead(node_handle) OVER on_thread = node_handle AS precedes_own_node
FROM initialisation
WINDOW on_thread AS (PARTITION BY thread_id ORDER BY event_id)
