-- description: Which initialisation of a node handle each object belongs to: the latest before it.
--     Any later one is better than none. A publisher may be created inside its node, right before
--     the node's own event: before Jazzy /rosout is. It belongs to the one right after. Where a
--     node handle is used again, what came first on the handle tells the two orders apart.
-- grain: one row per object or timer link that names a node
-- when: raw.ros2_rcl_publisher_init, raw.ros2_rcl_subscription_init, raw.ros2_rcl_service_init,
--     raw.ros2_rcl_client_init, raw.ros2_rclcpp_timer_link_node,
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
),
construction AS (
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
),
use AS (
    SELECT event_id, process_id, node_handle, precedes_own_node
    FROM construction
    WHERE kind <> 'node'
),
node_init AS (SELECT event_id, process_id, node_handle FROM construction WHERE kind = 'node'),
earlier AS (
    SELECT u.event_id, n.event_id AS node_event_id
    FROM use AS u
    ASOF LEFT JOIN node_init AS n
        ON u.process_id = n.process_id
        AND u.node_handle = n.node_handle
        AND u.event_id >= n.event_id
),
later AS (
    SELECT u.event_id, n.event_id AS node_event_id
    FROM use AS u
    ASOF LEFT JOIN node_init AS n
        ON u.process_id = n.process_id
        AND u.node_handle = n.node_handle
        AND u.event_id <= n.event_id
)
SELECT
    u.event_id, u.process_id, u.node_handle,
    CASE
        WHEN u.precedes_own_node THEN l.node_event_id
        ELSE coalesce(e.node_event_id, l.node_event_id)
    END AS node_event_id
FROM use AS u
JOIN earlier AS e ON u.event_id = e.event_id
JOIN later AS l ON u.event_id = l.event_id
