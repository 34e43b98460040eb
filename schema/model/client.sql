-- name: staging.client
-- description: Service clients, with the GID by which servers know them (since Kilted).
-- grain: one row per client
-- needs: staging.located, staging.object_node, staging.is_internal_service, staging.gid_bytes
WITH rmw_init AS (
    SELECT event_id, process_id, rmw_client_handle, staging.gid_bytes(gid) AS gid
    FROM staging.located('ros2_rmw_client_init')
)
SELECT
    row_number() OVER (ORDER BY c.event_id) AS client_id,
    c.process_id,
    n.node_id,
    c.service_name,
    c.client_handle,
    c.rmw_client_handle AS rmw_handle,
    r.gid,
    c.ts_ns AS created_ns,
    staging.is_internal_service(c.service_name) AS is_internal,
    c.event_id
FROM staging.located('ros2_rcl_client_init') AS c
ASOF LEFT JOIN rmw_init AS r
    ON c.process_id = r.process_id
    AND c.rmw_client_handle = r.rmw_client_handle
    AND c.event_id >= r.event_id
LEFT JOIN staging.object_node AS n ON c.event_id = n.event_id
