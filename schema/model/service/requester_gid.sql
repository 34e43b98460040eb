-- name: staging.requester_gid
-- description: How services name the clients that they heard of: there are few, and many events of
--     each.
-- grain: one row per client GID in the events of services
-- when: raw.ros2_rmw_send_response, raw.ros2_rmw_take_request
SELECT client_gid, staging.gid_bytes(client_gid) AS gid
FROM (
    SELECT client_gid FROM raw.ros2_rmw_take_request WHERE taken IS DISTINCT FROM 0
    UNION
    SELECT client_gid FROM raw.ros2_rmw_send_response
)
