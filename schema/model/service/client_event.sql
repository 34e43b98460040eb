-- description: Requests that clients sent and responses that they took, each with its client.
-- grain: one row per rmw_send_request or successful rmw_take_response
-- when: raw.ros2_rmw_send_request, raw.ros2_rmw_take_response
WITH event AS NOT MATERIALIZED (
    SELECT
        event_id, ts_ns, thread_index,
        true AS is_request,
        rmw_client_handle AS handle,
        sequence_number,
        NULL::BIGINT AS source_timestamp_ns
    FROM raw.ros2_rmw_send_request
    UNION ALL
    SELECT
        event_id, ts_ns, thread_index, false, rmw_client_handle, sequence_number,
        nullif(source_timestamp, 0)
    FROM raw.ros2_rmw_take_response
    WHERE taken IS DISTINCT FROM 0
),
client AS (
    SELECT
        event_id, process_id,
        rmw_handle AS handle
    FROM staging.client_known
)
SELECT
    event_id, ts_ns, thread_id, process_id, is_request,
    handle AS rmw_handle,
    sequence_number, source_timestamp_ns,
    object_event_id AS client_event_id,
    is_inferred
FROM staging.endpoint_event('event', 'client')
