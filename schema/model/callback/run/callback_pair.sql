-- kind: inline
-- description: Begins of callbacks with their end: the plain ones, and those left over. `is_plain`
--     where no other begin or end of a callback lies between.
-- grain: one row per callback_start
SELECT
    start_event_id, end_event_id, start_ns, end_ns, trace_index, thread_id, process_id,
    callback_handle, is_intra_process, previous_event_id, previous_callback_event_id,
    previous_executor_event_id, executor_event_id, true AS is_plain
FROM staging.callback_pair_plain
UNION ALL
SELECT
    event_id, partner_event_id, ts_ns, partner_ns, trace_index, thread_id, process_id,
    callback_handle, is_intra_process, previous_event_id, previous_callback_event_id,
    previous_executor_event_id, executor_event_id, false
FROM staging.callback_pair_left_over
WHERE is_start
