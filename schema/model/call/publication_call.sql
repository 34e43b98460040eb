-- name: staging.publication_call
-- kind: inline
-- description: All publish() calls: whole ones, as they were put together while they were read, and
--     the rest.
-- grain: one row per publish() call
-- after: staging.taken_apart
WITH whole AS (
    SELECT
        rclcpp_publish_event_id AS start_event_id,
        rmw_publish_event_id AS end_event_id,
        trace_index,
        thread_index,
        rclcpp_publish_ts_ns AS start_ns,
        rmw_publish_ts_ns AS end_ns,
        rclcpp_publish_ts_ns AS rclcpp_ns,
        rcl_publish_ts_ns AS rcl_ns,
        coalesce(rcl_publish_publisher_handle, rclcpp_publish_publisher_handle)
            AS publisher_handle,
        rmw_publish_rmw_publisher_handle AS rmw_handle,
        nullif(rmw_publish_timestamp, 0)::BIGINT AS stamp,
        previous_callback_event_id
    FROM raw.whole_publication
    UNION ALL
    SELECT
        rcl_publish_event_id,
        rmw_publish_event_id,
        trace_index,
        thread_index,
        rcl_publish_ts_ns,
        rmw_publish_ts_ns,
        NULL,
        rcl_publish_ts_ns,
        rcl_publish_publisher_handle,
        rmw_publish_rmw_publisher_handle,
        nullif(rmw_publish_timestamp, 0)::BIGINT,
        previous_callback_event_id
    FROM raw.whole_rcl_publication
)
SELECT
    w.start_event_id,
    w.end_event_id,
    w.trace_index,
    c.thread_id,
    c.process_id,
    w.start_ns,
    w.end_ns,
    NULL::BIGINT AS intra_ns,
    w.rclcpp_ns,
    w.rcl_ns,
    w.end_ns AS rmw_ns,
    NULL::BIGINT AS dds_ns,
    w.publisher_handle,
    w.rmw_handle,
    NULL::UBIGINT AS writer,
    w.stamp AS source_timestamp_ns,
    w.previous_callback_event_id AS callback_event_id
FROM whole AS w
JOIN staging.context AS c
    ON w.thread_index = c.thread_index
    AND w.start_event_id >= c.from_event_id
    AND w.start_event_id < c.until_event_id
UNION ALL
FROM staging.publication_rest
