-- description: Service clients. A handle that was used but never initialised in the trace gets a
--     row without node, and the name of the service that it turned out to call.
-- grain: one row per client
-- when: staging.client_event, staging.client_known
WITH learned AS (
    SELECT
        u.client_event_id,
        mode(s.service_name ORDER BY s.service_name) AS service_name
    FROM (SELECT DISTINCT client_event_id, service_event_id FROM staging.exchange) AS u
    JOIN raw.ros2_rcl_service_init AS s ON u.service_event_id = s.event_id
    GROUP BY u.client_event_id
),
every_client AS (
    FROM staging.client_known
    UNION ALL BY NAME
    SELECT e.event_id, e.process_id, l.service_name, e.rmw_handle
    FROM staging.client_event AS e
    LEFT JOIN learned AS l ON e.event_id = l.client_event_id
    WHERE e.is_inferred AND e.event_id = e.client_event_id
)
SELECT
    row_number() OVER (ORDER BY c.event_id) AS client_id,
    c.process_id, n.node_id, c.service_name, c.client_handle, c.rmw_handle, g.gid, c.created_ns,
    staging.is_internal_service(c.service_name) AS is_internal,
    c.event_id
FROM every_client AS c
LEFT JOIN staging.object_node AS n ON c.event_id = n.event_id
LEFT JOIN staging.client_gid AS g ON c.event_id = g.client_event_id
