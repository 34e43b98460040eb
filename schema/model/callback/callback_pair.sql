-- name: staging.callback_pair
-- kind: inline
-- description: Begins of callbacks with their end: the plain ones, and those left over. `is_plain`
--     where no other begin or end of a callback lies between.
-- grain: one row per callback_start
SELECT
    start_event_id, end_event_id, start_ns, end_ns, trace_index, thread_id, process_id,
    callback_handle, is_intra_process, previous_event_id, previous_callback_event_id,
    previous_executor_event_id, executor_event_id, true AS is_plain
FROM staging.callback_plain
UNION ALL
SELECT
    s.event_id, p.partner_event_id, s.ts_ns, p.partner_ns, s.trace_index, s.thread_id, s.process_id,
    s.callback_handle, s.is_intra_process, s.previous_event_id, s.previous_callback_event_id,
    s.previous_executor_event_id, s.executor_event_id, false
FROM staging.callback_event AS s
JOIN staging.callback_left_over AS p ON s.event_id = p.event_id
WHERE s.is_start
