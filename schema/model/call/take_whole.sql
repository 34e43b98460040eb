-- name: staging.take_whole
-- kind: inline
-- description: Successful takes of which all layers are there, as they were put together while they
--     were read.
-- grain: one row per such take
-- after: staging.taken_apart
SELECT
    w.rmw_take_event_id AS start_event_id,
    w.rclcpp_take_event_id AS end_event_id,
    w.trace_index,
    c.thread_id,
    c.process_id,
    w.rmw_take_ts_ns AS taken_ns,
    'rmw' AS method,
    w.rmw_take_rmw_subscription_handle AS rmw_handle,
    NULL::UBIGINT AS callback_handle,
    NULL::UBIGINT AS buffer_handle,
    nullif(w.rmw_take_source_timestamp, 0) AS source_timestamp_ns
FROM raw.whole_take AS w
JOIN staging.context AS c
    ON w.thread_index = c.thread_index
    AND w.rmw_take_event_id >= c.from_event_id
    AND w.rmw_take_event_id < c.until_event_id
WHERE w.rmw_take_taken IS DISTINCT FROM 0
