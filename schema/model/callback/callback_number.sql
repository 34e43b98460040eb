-- name: staging.callback_number
-- description: The number of each callback instance, in the order in which they began, with its
--     callback and the take that it was called with. A step of its own: looked up for the whole
--     instances at once, all three would stay in memory beside them.
-- grain: one row per callback instance
-- needs: staging.callback_pair, staging.callback_binding, staging.callback, staging.take_number
WITH callback_of AS (
    SELECT b.start_event_id, c.callback_id
    FROM staging.callback_binding AS b
    JOIN staging.callback AS c ON b.callback_event_id = c.event_id
    UNION ALL
    SELECT b.start_event_id, c.callback_id
    FROM staging.callback_binding AS b
    JOIN (
        SELECT process_id, callback_handle, min(callback_id) AS callback_id
        FROM staging.callback
        WHERE created_ns IS NULL
        GROUP BY process_id, callback_handle
    ) AS c ON b.process_id = c.process_id AND b.callback_handle = c.callback_handle
    WHERE b.callback_event_id IS NULL
),
-- Apart, since what is sorted should be narrow.
place AS (
    SELECT start_event_id, row_number() OVER (ORDER BY start_event_id) AS callback_instance_id
    FROM staging.callback_pair
)
SELECT p.start_event_id, p.callback_instance_id, c.callback_id, t.take_id
FROM place AS p
JOIN callback_of AS c ON p.start_event_id = c.start_event_id
LEFT JOIN staging.take_number AS t ON p.start_event_id = t.callback_start_event_id
