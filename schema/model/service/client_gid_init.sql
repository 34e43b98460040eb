-- name: staging.client_gid_init
-- description: The GIDs that the middleware gave to clients.
-- grain: one row per rmw_client_init
-- when: raw.ros2_rmw_client_init
SELECT event_id, process_id, rmw_client_handle AS rmw_handle, staging.gid_bytes(gid) AS gid
FROM staging.located('ros2_rmw_client_init')
