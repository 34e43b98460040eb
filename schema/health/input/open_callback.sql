-- title: Callback instances without an end
-- description: Callback instances whose end is not in the trace. Their durations are not known.
-- cause: The trace or the process ended, a callback threw, or events were lost.
-- cure: None needed for the last one of a thread. The finding unbalanced_callbacks has the others.
-- grain: one row per trace
-- severity: info
-- when: staging.callback_run WHERE end_ns IS NULL
SELECT
    trace_index + 1 AS trace_id,
    count(*) AS count,
    'callback instances without an end: the trace or the process ended, a callback threw, or '
    || 'events were lost' AS detail
FROM staging.callback_run
SEMI JOIN staging.callback_number USING (start_event_id)
ANTI JOIN staging.deferred_end USING (start_event_id)
WHERE end_ns IS NULL
GROUP BY trace_index
