-- name: staging.node
-- description: Nodes. A handle that objects name but that was never initialised in the trace gets
--     a row without a name.
-- grain: one row per ROS node
-- when: raw.ros2_rcl_node_init, staging.node_use
WITH known AS (
    SELECT
        event_id,
        process_id,
        node_name AS name,
        namespace,
        namespace || CASE WHEN namespace LIKE '%/' THEN '' ELSE '/' END || node_name AS full_name,
        node_handle,
        ts_ns AS created_ns,
        false AS is_inferred
    FROM staging.located('ros2_rcl_node_init')
),
unknown AS (
    SELECT
        min(event_id) AS event_id,
        process_id,
        NULL AS name,
        NULL AS namespace,
        NULL AS full_name,
        node_handle,
        NULL AS created_ns,
        true AS is_inferred
    FROM staging.node_use
    WHERE node_event_id IS NULL
    GROUP BY process_id, node_handle
),
every_node AS (
    SELECT event_id, process_id, name, namespace, full_name, node_handle, created_ns, is_inferred
    FROM known
    UNION ALL
    SELECT event_id, process_id, name, namespace, full_name, node_handle, created_ns, is_inferred
    FROM unknown
)
SELECT
    row_number() OVER (ORDER BY event_id) AS node_id,
    process_id, name, namespace, full_name, node_handle, created_ns, is_inferred, event_id
FROM every_node
