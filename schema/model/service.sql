-- name: staging.service
-- description: Services. No tracepoint tells their GID.
-- grain: one row per service
-- needs: staging.located, staging.object_node, staging.is_internal_service
SELECT
    row_number() OVER (ORDER BY s.event_id) AS service_id,
    s.process_id,
    n.node_id,
    s.service_name,
    s.service_handle,
    s.rmw_service_handle AS rmw_handle,
    NULL::BLOB AS gid,
    s.ts_ns AS created_ns,
    staging.is_internal_service(s.service_name) AS is_internal,
    s.event_id
FROM staging.located('ros2_rcl_service_init') AS s
LEFT JOIN staging.object_node AS n ON s.event_id = n.event_id
