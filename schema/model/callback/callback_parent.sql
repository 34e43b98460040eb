-- name: staging.callback_parent
-- description: Callback instances that are nested in another one.
-- grain: one row per such callback instance
-- when: staging.callback_depth
WITH outer_run AS (
    SELECT n.callback_instance_id, r.start_event_id, r.thread_id, r.depth
    FROM staging.callback_run AS r
    JOIN staging.callback_number AS n ON r.start_event_id = n.start_event_id
    WHERE NOT r.is_plain
)
SELECT r.start_event_id, o.callback_instance_id AS parent_id
FROM (SELECT * FROM staging.callback_run WHERE depth > 1) AS r
ASOF JOIN outer_run AS o
    ON r.thread_id = o.thread_id
    AND r.depth - 1 = o.depth
    AND r.start_event_id > o.start_event_id
