-- name: staging.callback_pair
-- kind: inline
-- description: Begins of callbacks with their end: whole ones, as they were put together while they
--     were read, and the rest. `is_plain` where no other begin or end of a callback lies between.
-- grain: one row per callback_start
-- after: staging.taken_apart
SELECT
    w.callback_start_event_id AS start_event_id,
    w.callback_end_event_id AS end_event_id,
    w.callback_start_ts_ns AS start_ns,
    w.callback_end_ts_ns AS end_ns,
    w.trace_index,
    c.thread_id,
    c.process_id,
    w.callback AS callback_handle,
    coalesce(w.callback_start_is_intra_process = 1, false) AS is_intra_process,
    w.callback_start_previous_call_event_id AS previous_event_id,
    w.callback_start_previous_callback_event_id AS previous_callback_event_id,
    w.callback_start_previous_executor_event_id AS previous_executor_event_id,
    w.callback_start_previous_executor_event_id AS executor_event_id,
    true AS is_plain
FROM raw.whole_callback AS w
JOIN staging.context AS c
    ON w.thread_index = c.thread_index
    AND w.callback_start_event_id >= c.from_event_id
    AND w.callback_start_event_id < c.until_event_id
UNION ALL
FROM staging.callback_rest
