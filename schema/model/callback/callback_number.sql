-- description: The number of each callback instance, in the order in which they began, with its
--     callback and the take that it was called with. A step of its own: looked up for the whole
--     instances at once, all three would stay in memory beside them.
-- grain: one row per callback instance
-- when: staging.callback_binding
WITH never_added AS (
    SELECT process_id, callback_handle, callback_id
    FROM staging.callback_object
    WHERE callback_event_id IS NULL
),
-- What is sorted should be narrow.
run AS (
    SELECT b.start_event_id, coalesce(c.callback_id, n.callback_id) AS callback_id
    FROM staging.callback_binding AS b
    LEFT JOIN staging.callback_object AS c ON b.callback_event_id = c.callback_event_id
    LEFT JOIN never_added AS n
        ON b.process_id = n.process_id AND b.callback_handle = n.callback_handle
),
numbered AS (
    SELECT
        start_event_id, callback_id,
        row_number() OVER (ORDER BY start_event_id) AS callback_instance_id
    FROM run
)
SELECT r.start_event_id, r.callback_instance_id, r.callback_id, t.take_id
FROM numbered AS r
LEFT JOIN staging.take_number AS t ON r.start_event_id = t.callback_start_event_id
WHERE r.callback_id IS NOT NULL
