-- description: The node of each object, by the event that initialised the object: the latest
--     initialisation of its node handle before it. Any later one is better than
--     nothing. A node that was never initialised is known by its first object (`is_inferred`). A
--     publisher may be created
--     inside its node, right before the node's own event: before Jazzy /rosout is. It belongs to
--     the one right after. Where a node handle is used again, what came first on the handle tells
--     the two orders apart.
-- grain: one row per node, and per object or timer link that names one
-- when: raw.ros2_rcl_node_init, raw.ros2_rcl_publisher_init, raw.ros2_rcl_subscription_init,
--     raw.ros2_rcl_service_init, raw.ros2_rcl_client_init, raw.ros2_rclcpp_timer_link_node,
--     raw.ros2_rcl_lifecycle_state_machine_init
WITH initialisation AS (
    SELECT
        event_id, thread_index,
        'node' AS kind,
        node_handle
    FROM raw.ros2_rcl_node_init
    UNION ALL
    SELECT event_id, thread_index, 'publisher', node_handle
    FROM raw.ros2_rcl_publisher_init
    UNION ALL
    SELECT event_id, thread_index, 'subscription', node_handle
    FROM raw.ros2_rcl_subscription_init
    UNION ALL
    SELECT event_id, thread_index, 'service', node_handle
    FROM raw.ros2_rcl_service_init
    UNION ALL
    SELECT event_id, thread_index, 'client', node_handle
    FROM raw.ros2_rcl_client_init
    UNION ALL
    SELECT event_id, thread_index, 'timer', node_handle
    FROM raw.ros2_rclcpp_timer_link_node
    UNION ALL
    SELECT event_id, thread_index, 'lifecycle', node_handle
    FROM raw.ros2_rcl_lifecycle_state_machine_init
),
construction AS (
    SELECT
        event_id, process_id, kind, node_handle,
        kind = 'publisher'
        AND lead(kind) OVER on_thread = 'node'
        AND lead(node_handle) OVER on_thread = node_handle
        AND first_value(kind) OVER of_handle <> 'node' AS precedes_own_node
    FROM staging.located('initialisation')
    WINDOW
        on_thread AS (PARTITION BY thread_id ORDER BY event_id),
        of_handle AS (PARTITION BY process_id, node_handle ORDER BY event_id)
),
node_init AS (SELECT event_id, process_id, node_handle FROM construction WHERE kind = 'node'),
used AS (
    SELECT
        u.event_id, u.process_id, u.node_handle,
        CASE
            WHEN u.precedes_own_node THEN l.event_id
            ELSE coalesce(e.event_id, l.event_id)
        END AS node_event_id
    FROM (SELECT * FROM construction WHERE kind <> 'node') AS u
    ASOF LEFT JOIN node_init AS e
        ON u.process_id = e.process_id
        AND u.node_handle = e.node_handle
        AND u.event_id >= e.event_id
    ASOF LEFT JOIN node_init AS l
        ON u.process_id = l.process_id
        AND u.node_handle = l.node_handle
        AND u.event_id <= l.event_id
),
placed AS (
    SELECT
        event_id, process_id, node_handle,
        coalesce(
            node_event_id,
            min(CASE WHEN node_event_id IS NULL THEN event_id END) OVER (
                PARTITION BY process_id, node_handle
            )
        ) AS node_event_id,
        node_event_id IS NULL AS is_inferred
    FROM used
    UNION ALL
    SELECT event_id, process_id, node_handle, event_id, false FROM node_init
)
SELECT
    event_id, process_id, node_handle, node_event_id, is_inferred,
    dense_rank() OVER (ORDER BY node_event_id) AS node_id
FROM placed
