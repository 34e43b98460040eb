-- name: staging.publication_call
-- description: publish() calls: an intra-process chain and the inter-process chain that directly
--     follows it for the same publisher are one call.
-- grain: one row per publish() call
-- needs: staging.publication_chain
WITH inter AS (
    SELECT i.start_event_id AS intra_start_event_id, c.start_event_id
    FROM staging.publication_chain AS c
    JOIN staging.publication_chain AS i
        ON c.intra_end_event_id = i.end_event_id AND c.rcl_handle = i.intra_handle
)
SELECT
    coalesce(i.intra_start_event_id, c.start_event_id) AS start_event_id,
    max(c.end_event_id) AS end_event_id,
    any_value(c.trace_index) AS trace_index,
    any_value(c.thread_id) AS thread_id,
    min(c.start_ns) AS start_ns,
    max(c.end_ns) AS end_ns,
    max(c.intra_ns) AS intra_ns,
    max(c.rclcpp_ns) AS rclcpp_ns,
    max(c.rcl_ns) AS rcl_ns,
    max(c.rmw_ns) AS rmw_ns,
    max(c.dds_ns) AS dds_ns,
    coalesce(max(c.rcl_handle), max(c.rclcpp_handle), max(c.intra_handle)) AS publisher_handle,
    max(c.rmw_handle) AS rmw_handle,
    max(c.writer) AS writer,
    max(c.source_timestamp_ns) AS source_timestamp_ns
FROM staging.publication_chain AS c
LEFT JOIN inter AS i ON c.start_event_id = i.start_event_id
GROUP BY coalesce(i.intra_start_event_id, c.start_event_id)
