-- description: Service clients whose initialisation was traced, with the GID by which servers know
--     them (since Kilted).
-- grain: one row per rcl_client_init
-- when: raw.ros2_rcl_client_init
WITH rmw_init AS (
    SELECT
        event_id, process_id, rmw_client_handle,
        staging.gid_bytes(gid) AS gid
    FROM staging.located('raw.ros2_rmw_client_init')
)
SELECT
    c.event_id, c.process_id, c.service_name, c.client_handle,
    c.rmw_client_handle AS rmw_handle,
    r.gid,
    c.ts_ns AS created_ns
FROM staging.located('raw.ros2_rcl_client_init') AS c
ASOF LEFT JOIN rmw_init AS r
    ON c.process_id = r.process_id
    AND c.rmw_client_handle = r.rmw_client_handle
    AND c.event_id >= r.event_id
