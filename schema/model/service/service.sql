-- name: staging.service
-- description: Services. One that was used but never initialised in the trace has no node.
-- grain: one row per service
-- when: staging.service_known, staging.service_inferred
WITH every_service AS (
    SELECT event_id, process_id, node_id, service_name, service_handle, rmw_handle, created_ns
    FROM staging.service_known
    UNION ALL
    SELECT event_id, process_id, NULL, service_name, service_handle, rmw_handle, NULL
    FROM staging.service_inferred
)
SELECT
    row_number() OVER (ORDER BY event_id) AS service_id,
    process_id,
    node_id,
    service_name,
    service_handle,
    rmw_handle,
    NULL::BLOB AS gid,
    created_ns,
    staging.is_internal_service(service_name) AS is_internal,
    event_id
FROM every_service
