-- name: staging.publication_number
-- description: The number of each publication, in the order of the calls, and its publisher. A step
--     of its own: looked up for the whole publications, both would stay in memory beside them.
-- grain: one row per publish() call
-- when: staging.publication_origin
SELECT
    o.start_event_id,
    row_number() OVER (ORDER BY o.start_event_id) AS publication_id,
    coalesce(p.publisher_id, i.publisher_id) AS publisher_id
FROM staging.publication_origin AS o
LEFT JOIN staging.publisher AS p ON o.publisher_event_id = p.event_id
LEFT JOIN (
    SELECT process_id, publisher_handle, publisher_id FROM staging.publisher WHERE is_inferred
) AS i ON o.process_id = i.process_id AND o.unknown_handle = i.publisher_handle
