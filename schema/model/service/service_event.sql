-- name: staging.service_event
-- description: Requests that services took and responses that they sent, each with its service
--     (found as for clients) and the GID of the client.
-- grain: one row per successful rmw_take_request or rmw_send_response
-- needs: staging.context, staging.service_known, staging.requester_gid, raw
WITH event AS NOT MATERIALIZED (
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
placed AS NOT MATERIALIZED (
    SELECT
        e.event_id, e.ts_ns, c.thread_id, c.process_id, e.is_request, e.rmw_handle,
        e.client_gid, e.sequence_number, e.source_timestamp_ns
    FROM event AS e
    JOIN staging.context AS c
        ON e.thread_index = c.thread_index
        AND e.event_id >= c.from_event_id
        AND e.event_id < c.until_event_id
),
known AS (
    SELECT event_id, process_id, rmw_handle FROM staging.service_known
),
repeated AS (
    SELECT process_id, rmw_handle
    FROM known
    GROUP BY process_id, rmw_handle
    HAVING count(*) > 1
),
-- Nearly every handle is used once: only the others need an order.
resolved AS NOT MATERIALIZED (
    SELECT p.*, k.event_id AS known_event_id
    FROM placed AS p
    LEFT JOIN known AS k
        ON p.process_id = k.process_id
        AND p.rmw_handle = k.rmw_handle
        AND p.event_id >= k.event_id
    ANTI JOIN repeated AS r ON p.process_id = r.process_id AND p.rmw_handle = r.rmw_handle
    UNION ALL
    SELECT p.*, k.event_id
    FROM (
        SELECT * FROM placed
        SEMI JOIN repeated AS r
            ON placed.process_id = r.process_id AND placed.rmw_handle = r.rmw_handle
    ) AS p
    ASOF LEFT JOIN known AS k
        ON p.process_id = k.process_id
        AND p.rmw_handle = k.rmw_handle
        AND p.event_id >= k.event_id
),
first_use AS (
    SELECT process_id, rmw_handle, min(event_id) AS event_id
    FROM resolved
    WHERE known_event_id IS NULL
    GROUP BY process_id, rmw_handle
)
SELECT
    r.event_id, r.ts_ns, r.thread_id, r.process_id, r.is_request, r.rmw_handle, g.gid,
    r.sequence_number, r.source_timestamp_ns,
    coalesce(r.known_event_id, f.event_id) AS service_event_id,
    r.known_event_id IS NULL AS is_inferred
FROM resolved AS r
LEFT JOIN first_use AS f
    ON r.known_event_id IS NULL AND r.process_id = f.process_id AND r.rmw_handle = f.rmw_handle
LEFT JOIN staging.requester_gid AS g ON r.client_gid = g.client_gid
