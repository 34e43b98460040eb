-- name: staging.client_event
-- description: Requests that clients sent and responses that they took, each with its client: the
--     one of that handle initialised last before, by its event, else a placeholder by the first
--     use of the handle.
-- grain: one row per rmw_send_request or successful rmw_take_response
-- needs: staging.context, staging.client_known, raw
WITH event AS NOT MATERIALIZED (
    SELECT
        event_id, ts_ns, thread_index, true AS is_request, rmw_client_handle AS rmw_handle,
        sequence_number, NULL::BIGINT AS source_timestamp_ns
    FROM raw.ros2_rmw_send_request
    UNION ALL
    SELECT
        event_id, ts_ns, thread_index, false, rmw_client_handle, sequence_number,
        nullif(source_timestamp, 0)
    FROM raw.ros2_rmw_take_response
    WHERE taken IS DISTINCT FROM 0
),
placed AS NOT MATERIALIZED (
    SELECT
        e.event_id, e.ts_ns, c.thread_id, c.process_id, e.is_request, e.rmw_handle,
        e.sequence_number, e.source_timestamp_ns
    FROM event AS e
    JOIN staging.context AS c
        ON e.thread_index = c.thread_index
        AND e.event_id >= c.from_event_id
        AND e.event_id < c.until_event_id
),
known AS (
    SELECT event_id, process_id, rmw_handle FROM staging.client_known
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
    r.event_id, r.ts_ns, r.thread_id, r.process_id, r.is_request, r.rmw_handle,
    r.sequence_number, r.source_timestamp_ns,
    coalesce(r.known_event_id, f.event_id) AS client_event_id,
    r.known_event_id IS NULL AS is_inferred
FROM resolved AS r
LEFT JOIN first_use AS f
    ON r.known_event_id IS NULL AND r.process_id = f.process_id AND r.rmw_handle = f.rmw_handle
