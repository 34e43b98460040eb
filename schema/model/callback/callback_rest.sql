-- name: staging.callback_rest
-- description: Begins of callbacks with their end, of those that are not whole; `is_plain` where no
--     other begin or end of a callback lies between.
-- grain: one row per such callback_start
WITH found AS (
    SELECT start_event_id, end_event_id, end_ns, true AS is_plain
    FROM staging.callback_plain
    UNION ALL
    SELECT event_id, partner_event_id, partner_ns, false
    FROM staging.callback_left_over
    WHERE is_start
)
SELECT
    s.event_id AS start_event_id, f.end_event_id, s.ts_ns AS start_ns, f.end_ns, s.trace_index,
    s.thread_id, s.process_id, s.callback_handle, s.is_intra_process, s.previous_event_id,
    s.previous_callback_event_id, s.previous_executor_event_id, s.executor_event_id, f.is_plain
FROM staging.callback_event AS s
JOIN found AS f ON s.event_id = f.start_event_id
