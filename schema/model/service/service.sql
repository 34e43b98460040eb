-- description: Services. One that was used but never initialised in the trace has no node.
-- grain: one row per service
-- when: staging.service_known, staging.service_inferred
WITH every_service AS (
    SELECT event_id, process_id, service_name, service_handle, rmw_handle, created_ns
    FROM staging.service_known
    UNION ALL
    SELECT event_id, process_id, service_name, service_handle, rmw_handle, NULL
    FROM staging.service_inferred
)
SELECT
    row_number() OVER (ORDER BY s.event_id) AS service_id,
    s.process_id, n.node_id, s.service_name, s.service_handle, s.rmw_handle,
    NULL::BLOB AS gid,
    s.created_ns,
    staging.is_internal_service(s.service_name) AS is_internal,
    s.event_id
FROM every_service AS s
LEFT JOIN staging.object_node AS n ON s.event_id = n.event_id
