-- description: The number of each publication, in the order of the calls, and its publisher: by rcl
--     handle, else rmw handle, else DDS writer, each as initialised last before the call. The rcl
--     handle of /rosout is that of a temporary object. So a call may have no rclcpp layer, a handle
--     that was never initialised, and nothing else that identifies it: it belongs to the only
--     /rosout publisher of its process. What only the middleware publishes has no publisher.
-- grain: one row per publish() call
-- when: staging.publication_call
WITH call AS NOT MATERIALIZED (
    SELECT
        start_event_id AS event_id,
        process_id,
        publisher_handle AS handle,
        rmw_handle, writer,
        rclcpp_ns IS NULL AND intra_ns IS NULL AND publisher_handle IS NOT NULL
        AND rmw_handle IS NULL AND writer IS NULL AS may_be_rosout
    FROM staging.publication_call
),
rcl_publisher AS (
    SELECT
        event_id, process_id,
        publisher_handle AS handle
    FROM staging.publisher_known
),
by_rcl AS (SELECT * FROM staging.with_latest('call', 'rcl_publisher')),
rosout AS (
    SELECT
        process_id,
        count(*) AS publisher_count,
        min(event_id) AS publisher_event_id
    FROM staging.publisher_known
    WHERE topic_name = '/rosout'
    GROUP BY process_id
),
-- Few, as a rule.
not_by_rcl AS (
    SELECT
        c.event_id, c.process_id, c.handle,
        coalesce(
            r.event_id, w.event_id,
            CASE WHEN c.may_be_rosout AND o.publisher_count = 1 THEN o.publisher_event_id END
        ) AS publisher_event_id,
        coalesce(c.may_be_rosout AND o.publisher_count > 1, false) AS is_rosout
    FROM (SELECT * FROM by_rcl WHERE object_event_id IS NULL) AS c
    ASOF LEFT JOIN staging.publisher_known AS r
        ON c.process_id = r.process_id AND c.rmw_handle = r.rmw_handle AND c.event_id >= r.event_id
    ASOF LEFT JOIN staging.publisher_known AS w
        ON c.process_id = w.process_id AND c.writer = w.writer AND c.event_id >= w.event_id
    LEFT JOIN rosout AS o ON c.process_id = o.process_id
),
published AS (
    SELECT
        event_id AS start_event_id,
        object_event_id AS publisher_event_id,
        false AS is_rosout
    FROM by_rcl
    WHERE object_event_id IS NOT NULL
    UNION ALL BY NAME
    SELECT
        event_id AS start_event_id,
        publisher_event_id, is_rosout, process_id,
        CASE WHEN publisher_event_id IS NULL THEN handle END AS unknown_handle
    FROM not_by_rcl
)
SELECT
    *,
    row_number() OVER (ORDER BY start_event_id) AS publication_id
FROM published
