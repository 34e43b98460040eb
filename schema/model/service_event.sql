-- name: staging.service_event
-- description: Requests that services took and responses that they sent, each with its service
--     (found as for clients) and the GID of the client.
-- grain: one row per successful rmw_take_request or rmw_send_response
-- needs: staging.context, staging.service_known, staging.gid_bytes, raw
WITH event AS (
    SELECT
        event_id, ts_ns, thread_index, true AS is_request, rmw_service_handle AS rmw_handle,
        client_gid, sequence_number, NULL::BIGINT AS source_timestamp_ns
    FROM raw.ros2_rmw_take_request
    WHERE taken IS DISTINCT FROM 0
    UNION ALL
    SELECT
        event_id, ts_ns, thread_index, false, rmw_service_handle, client_gid, sequence_number,
        nullif(timestamp, 0)
    FROM raw.ros2_rmw_send_response
),
-- There are few clients, and many events of each.
gid AS (
    SELECT client_gid, staging.gid_bytes(client_gid) AS gid
    FROM (SELECT DISTINCT client_gid FROM event)
),
resolved AS (
    SELECT
        e.event_id, e.ts_ns, c.thread_id, c.process_id, e.is_request, e.rmw_handle, g.gid,
        e.sequence_number, e.source_timestamp_ns, k.event_id AS known_event_id
    FROM event AS e
    LEFT JOIN gid AS g ON e.client_gid = g.client_gid
    JOIN staging.context AS c
        ON e.thread_index = c.thread_index
        AND e.event_id >= c.from_event_id
        AND e.event_id < c.until_event_id
    ASOF LEFT JOIN staging.service_known AS k
        ON c.process_id = k.process_id
        AND e.rmw_handle = k.rmw_handle
        AND e.event_id >= k.event_id
),
first_use AS (
    SELECT process_id, rmw_handle, min(event_id) AS event_id
    FROM resolved
    WHERE known_event_id IS NULL
    GROUP BY process_id, rmw_handle
)
SELECT
    r.event_id, r.ts_ns, r.thread_id, r.process_id, r.is_request, r.rmw_handle, r.gid,
    r.sequence_number, r.source_timestamp_ns,
    coalesce(r.known_event_id, f.event_id) AS service_event_id,
    r.known_event_id IS NULL AS is_inferred
FROM resolved AS r
LEFT JOIN first_use AS f
    ON r.known_event_id IS NULL AND r.process_id = f.process_id AND r.rmw_handle = f.rmw_handle
