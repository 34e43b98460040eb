-- name: staging.publication
-- description: Publications in the order of their calls.
-- grain: one row per publish() call
-- needs: staging.publication_call, staging.publication_origin, staging.publisher, staging.thread
WITH publisher_of AS (
    SELECT o.start_event_id, p.publisher_id
    FROM staging.publication_origin AS o
    JOIN staging.publisher AS p ON o.publisher_event_id = p.event_id
    UNION ALL
    SELECT o.start_event_id, p.publisher_id
    FROM staging.publication_origin AS o
    JOIN staging.publisher AS p
        ON o.process_id = p.process_id AND o.unknown_handle = p.publisher_handle
    WHERE p.is_inferred
)
SELECT
    row_number() OVER (ORDER BY c.start_event_id) AS publication_id,
    c.trace_index + 1 AS trace_id,
    p.publisher_id,
    t.process_id,
    c.thread_id,
    c.start_ns,
    c.end_ns,
    c.intra_ns,
    c.rclcpp_ns,
    c.rcl_ns,
    c.rmw_ns,
    c.dds_ns,
    c.source_timestamp_ns,
    c.start_event_id,
    c.end_event_id
FROM staging.publication_call AS c
JOIN staging.thread AS t ON c.thread_id = t.thread_id
LEFT JOIN publisher_of AS p ON c.start_event_id = p.start_event_id
