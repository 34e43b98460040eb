-- description: Publishers. A handle that was published on but never initialised in the trace gets a
--     row without topic, or with /rosout where nothing else is possible.
-- grain: one row per publisher
-- when: staging.publisher_known, staging.publication_number
WITH every_publisher AS (
    SELECT
        *,
        false AS is_inferred
    FROM staging.publisher_known
    UNION ALL BY NAME
    SELECT
        min(start_event_id) AS event_id,
        process_id,
        CASE WHEN bool_and(is_rosout) THEN '/rosout' END AS topic_name,
        unknown_handle AS publisher_handle,
        bool_and(is_rosout) AS is_internal,
        true AS is_inferred,
        false AS is_agnocast
    FROM staging.publication_number
    WHERE unknown_handle IS NOT NULL
    GROUP BY process_id, unknown_handle
)
SELECT
    row_number() OVER (ORDER BY p.event_id) AS publisher_id,
    p.process_id, n.node_id, p.topic_name, p.publisher_handle, p.rmw_handle, p.gid, p.queue_depth,
    p.created_ns, p.is_internal, p.is_inferred,
    false AS is_topic_learned,
    false AS is_topic_declared,
    p.is_agnocast, p.event_id
FROM every_publisher AS p
LEFT JOIN staging.object_node AS n ON p.event_id = n.event_id
