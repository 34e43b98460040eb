-- description: The number of each callback instance, in the order in which they began, with its
--     callback and the take that it was called with. A step of its own: looked up for the whole
--     instances at once, all three would stay in memory beside them.
-- grain: one row per callback instance
-- when: staging.callback_binding

-- What is sorted should be narrow.
WITH numbered AS (
    SELECT
        b.start_event_id, c.callback_id,
        row_number() OVER (ORDER BY b.start_event_id) AS callback_instance_id
    FROM staging.callback_binding AS b
    JOIN staging.callback_object AS c ON b.callback_event_id = c.event_id
)
SELECT r.start_event_id, r.callback_instance_id, r.callback_id, t.take_id
FROM numbered AS r
LEFT JOIN staging.take_number AS t ON r.start_event_id = t.callback_start_event_id
