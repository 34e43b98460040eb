-- description: Requests that services took and responses that they sent, each with its service and
--     the GID of the client.
-- grain: one row per successful rmw_take_request or rmw_send_response
-- when: raw.ros2_rmw_send_response, raw.ros2_rmw_take_request
WITH event AS NOT MATERIALIZED (
    SELECT
        event_id, ts_ns, thread_index,
        true AS is_request,
        rmw_service_handle AS handle,
        client_gid, sequence_number,
        NULL::BIGINT AS source_timestamp_ns
    FROM raw.ros2_rmw_take_request
    WHERE taken IS DISTINCT FROM 0
    UNION ALL
    SELECT
        event_id, ts_ns, thread_index, false, rmw_service_handle, client_gid, sequence_number,
        nullif(timestamp, 0)
    FROM raw.ros2_rmw_send_response
),
-- There are few clients, and many events of each.
requester AS (
    SELECT
        client_gid,
        staging.gid_bytes(client_gid) AS gid
    FROM event
    GROUP BY client_gid
),
service AS (
    SELECT
        event_id, process_id,
        rmw_service_handle AS handle
    FROM staging.located('raw.ros2_rcl_service_init')
)
SELECT
    e.event_id, e.ts_ns, e.thread_id, e.process_id, e.is_request,
    e.handle AS rmw_handle,
    g.gid, e.sequence_number, e.source_timestamp_ns,
    e.object_event_id AS service_event_id,
    e.is_inferred
FROM staging.endpoint_event('event', 'service') AS e
LEFT JOIN requester AS g ON e.client_gid = g.client_gid
