-- description: Services. One that was used but never initialised in the trace has no node.
-- grain: one row per service
-- when: raw.ros2_rcl_service_init, staging.service_event WHERE is_inferred,
--     staging.callback_owner WHERE kind = 'service'

-- Those without initialisation, with the name that their clients call them by.
-- when: staging.service_event WHERE is_inferred, staging.callback_owner WHERE kind = 'service'
-- columns: event_id BIGINT, process_id BIGINT, service_name VARCHAR, service_handle UBIGINT,
--     rmw_handle UBIGINT
CREATE OR REPLACE TEMP TABLE service_inferred AS
WITH learned AS (
    SELECT
        u.service_event_id,
        mode(c.service_name ORDER BY c.service_name) AS service_name
    FROM (SELECT DISTINCT client_event_id, service_event_id FROM staging.exchange) AS u
    JOIN staging.client_known AS c ON u.client_event_id = c.event_id
    GROUP BY u.service_event_id
),
attached AS (
    SELECT
        e.service_event_id,
        mode(k.service_handle ORDER BY k.service_handle) AS service_handle
    FROM staging.service_event AS e
    JOIN staging.callback_binding AS b ON e.event_id = b.request_event_id
    JOIN staging.callback_known AS k ON b.callback_event_id = k.event_id
    WHERE e.is_inferred
    GROUP BY e.service_event_id
)
SELECT e.event_id, e.process_id, l.service_name, a.service_handle, e.rmw_handle
FROM staging.service_event AS e
LEFT JOIN learned AS l ON e.event_id = l.service_event_id
LEFT JOIN attached AS a ON e.event_id = a.service_event_id
WHERE e.is_inferred AND e.event_id = e.service_event_id
UNION ALL BY NAME
SELECT
    owner_event_id AS event_id,
    process_id,
    any_value(handle) AS service_handle
FROM staging.callback_owner
WHERE kind = 'service' AND is_inferred
GROUP BY owner_event_id, process_id;

WITH every_service AS (
    SELECT
        event_id, process_id, service_name, service_handle,
        rmw_service_handle AS rmw_handle,
        ts_ns AS created_ns
    FROM staging.located('raw.ros2_rcl_service_init')
    UNION ALL BY NAME
    FROM service_inferred
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
