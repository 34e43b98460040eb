-- name: staging.publication_origin
-- description: The publisher of each call: by rcl handle, else rmw handle, else DDS writer, each as
--     initialised last before the call. The rcl handle of /rosout is that of a temporary object:
--     a call without rclcpp layer whose handle was never initialised, and that nothing else
--     identifies, belongs to the process's only /rosout publisher. What only the middleware
--     publishes has none.
-- grain: one row per publish() call
-- needs: staging.publication_call, staging.publisher_known, staging.with_latest
WITH call AS (
    SELECT
        c.start_event_id, c.process_id, c.publisher_handle, c.rmw_handle, c.writer,
        c.rclcpp_ns IS NULL AND c.intra_ns IS NULL AND c.publisher_handle IS NOT NULL
        AND c.rmw_handle IS NULL AND c.writer IS NULL AS may_be_rosout
    FROM staging.publication_call AS c
),
used AS NOT MATERIALIZED (
    SELECT start_event_id AS event_id, process_id, publisher_handle AS handle FROM call
),
known AS (
    SELECT event_id, process_id, publisher_handle AS handle FROM staging.publisher_known
),
by_rcl AS (
    SELECT event_id AS start_event_id, object_event_id AS publisher_event_id
    FROM staging.with_latest('used', 'known')
    WHERE object_event_id IS NOT NULL
),
not_by_rcl AS (
    SELECT c.start_event_id, c.process_id, c.publisher_handle, c.rmw_handle, c.writer,
        c.may_be_rosout
    FROM call AS c
    ANTI JOIN by_rcl AS r ON c.start_event_id = r.start_event_id
),
by_rmw AS (
    SELECT c.start_event_id, p.event_id AS publisher_event_id
    FROM not_by_rcl AS c
    ASOF JOIN staging.publisher_known AS p
        ON c.process_id = p.process_id
        AND c.rmw_handle = p.rmw_handle
        AND c.start_event_id >= p.event_id
),
by_writer AS (
    SELECT c.start_event_id, p.event_id AS publisher_event_id
    FROM not_by_rcl AS c
    ASOF JOIN staging.publisher_known AS p
        ON c.process_id = p.process_id
        AND c.writer = p.writer
        AND c.start_event_id >= p.event_id
),
rosout AS (
    SELECT process_id, count(*) AS publisher_count, min(event_id) AS publisher_event_id
    FROM staging.publisher_known
    WHERE topic_name = '/rosout'
    GROUP BY process_id
),
resolved AS (
    SELECT
        c.start_event_id,
        c.process_id,
        c.publisher_handle,
        coalesce(
            m.publisher_event_id,
            w.publisher_event_id,
            CASE
                WHEN c.may_be_rosout AND o.publisher_count = 1 THEN o.publisher_event_id
            END
        ) AS publisher_event_id,
        c.may_be_rosout AND o.publisher_count > 1 AS is_rosout
    FROM not_by_rcl AS c
    LEFT JOIN by_rmw AS m ON c.start_event_id = m.start_event_id
    LEFT JOIN by_writer AS w ON c.start_event_id = w.start_event_id
    LEFT JOIN rosout AS o ON c.process_id = o.process_id
)
SELECT
    start_event_id,
    NULL::BIGINT AS process_id,
    NULL::UBIGINT AS unknown_handle,
    publisher_event_id,
    false AS is_rosout
FROM by_rcl
UNION ALL
SELECT
    start_event_id,
    process_id,
    CASE WHEN publisher_event_id IS NULL THEN publisher_handle END,
    publisher_event_id,
    coalesce(is_rosout, false)
FROM resolved
