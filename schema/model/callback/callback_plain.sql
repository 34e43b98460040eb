-- name: staging.callback_plain
-- description: Begins of callbacks, not whole yet, whose end is the next begin or end of any
--     callback on their thread. No gap lies between.
-- grain: one row per such begin and end
SELECT s.event_id AS start_event_id, e.event_id AS end_event_id, e.ts_ns AS end_ns
FROM staging.callback_event AS e
JOIN staging.callback_event AS s
    ON e.previous_callback_event_id = s.event_id
    AND e.thread_id = s.thread_id
    AND e.callback_handle = s.callback_handle
    AND e.segment = s.segment
WHERE NOT e.is_start AND s.is_start
