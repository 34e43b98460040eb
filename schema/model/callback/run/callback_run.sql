-- kind: inline
-- description: Callback instances with their extent and nesting.
-- grain: one row per callback_start
SELECT
    p.start_event_id, p.end_event_id,
    coalesce(p.end_event_id, n.effective_end_event_id) AS effective_end_event_id,
    p.start_ns, p.end_ns, p.trace_index, p.thread_id, p.process_id, p.callback_handle,
    p.is_intra_process, p.previous_event_id, p.executor_event_id, p.is_plain,
    coalesce(n.depth, 1) AS depth
FROM staging.callback_pair AS p
LEFT JOIN staging.callback_nesting AS n ON p.start_event_id = n.start_event_id
