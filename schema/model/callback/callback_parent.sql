-- name: staging.callback_parent
-- description: Callback instances that are nested in another one, and that one.
-- grain: one row per such callback instance
-- when: staging.callback_depth
SELECT r.start_event_id, o.start_event_id AS parent_event_id
FROM (SELECT * FROM staging.callback_run WHERE depth > 1) AS r
ASOF JOIN (SELECT * FROM staging.callback_run WHERE NOT is_plain) AS o
    ON r.thread_id = o.thread_id
    AND r.depth - 1 = o.depth
    AND r.start_event_id > o.start_event_id
