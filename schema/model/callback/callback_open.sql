-- name: staging.callback_open
-- description: Callback instances that were never seen to end. Apart, since they are few, which
--     decides how what closes them is best looked for.
-- grain: one row per such callback instance
-- when: staging.callback_event
SELECT start_event_id, thread_id, previous_executor_event_id
FROM staging.callback_pair
WHERE end_event_id IS NULL
