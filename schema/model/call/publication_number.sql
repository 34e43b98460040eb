-- description: The number of each publication, in the order of the calls, and its publisher: by rcl
--     handle, else rmw handle, else DDS writer, each as initialised last before the call. The rcl
--     handle of /rosout is that of a temporary object. So a call may have no rclcpp layer, a handle
--     that was never initialised, and nothing else that identifies it: it belongs to the only
--     /rosout publisher of its process. What only the middleware publishes has no publisher.
-- grain: one row per publish() call
-- when: staging.publication_call
WITH call AS NOT MATERIALIZED (
    SELECT
        start_event_id AS event_id, process_id, publisher_handle AS handle, rmw_handle, writer,
        rclcpp_ns IS NULL AND intra_ns IS NULL AND publisher_handle IS NOT NULL
        AND rmw_handle IS NULL AND writer IS NULL AS may_be_rosout
    FROM staging.publication_call
),
rcl_publisher AS (
    SELECT event_id, process_id, publisher_handle AS handle FROM staging.publisher_known
),
rmw_publisher AS (SELECT event_id, process_id, rmw_handle AS handle FROM staging.publisher_known),
dds_writer AS (SELECT event_id, process_id, writer AS handle FROM staging.publisher_known),
by_rcl AS NOT MATERIALIZED (SELECT * FROM staging.with_latest('call', 'rcl_publisher')),
-- Few, as a rule, which are looked at twice.
not_by_rcl AS MATERIALIZED (
    SELECT
        event_id, process_id, rmw_handle AS handle, writer, handle AS publisher_handle,
        may_be_rosout
    FROM by_rcl
    WHERE object_event_id IS NULL
),
by_rmw AS MATERIALIZED (
    SELECT
        event_id, process_id, writer AS handle, publisher_handle, may_be_rosout,
        object_event_id AS rmw_event_id
    FROM staging.with_latest('not_by_rcl', 'rmw_publisher')
),
rosout AS (
    SELECT process_id, count(*) AS publisher_count, min(event_id) AS publisher_event_id
    FROM staging.publisher_known
    WHERE topic_name = '/rosout'
    GROUP BY process_id
),
resolved AS (
    SELECT
        w.event_id, w.process_id, w.publisher_handle,
        coalesce(
            w.rmw_event_id, w.object_event_id,
            CASE WHEN w.may_be_rosout AND o.publisher_count = 1 THEN o.publisher_event_id END
        ) AS publisher_event_id,
        w.may_be_rosout AND o.publisher_count > 1 AS is_rosout
    FROM staging.with_latest('by_rmw', 'dds_writer') AS w
    LEFT JOIN rosout AS o ON w.process_id = o.process_id
),
published AS (
    SELECT
        event_id AS start_event_id,
        NULL::BIGINT AS process_id,
        NULL::UBIGINT AS unknown_handle,
        object_event_id AS publisher_event_id, false AS is_rosout
    FROM by_rcl
    WHERE object_event_id IS NOT NULL
    UNION ALL
    SELECT
        event_id, process_id,
        CASE WHEN publisher_event_id IS NULL THEN publisher_handle END,
        publisher_event_id,
        coalesce(is_rosout, false)
    FROM resolved
)
SELECT *, row_number() OVER (ORDER BY start_event_id) AS publication_id FROM published
