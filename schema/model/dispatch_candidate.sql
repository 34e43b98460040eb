-- name: staging.dispatch_candidate
-- description: The last executor event before each start of a callback on its thread, whatever may
--     have been lost between the two.
-- grain: one row per callback_start on a thread that had an executor event before
-- needs: staging.callback_event, staging.executor_event
SELECT c.event_id AS start_event_id, x.event_id AS executor_event_id
FROM staging.callback_event AS c
ASOF JOIN staging.executor_event AS x
    ON c.thread_id = x.thread_id AND c.event_id > x.event_id
WHERE c.is_start
