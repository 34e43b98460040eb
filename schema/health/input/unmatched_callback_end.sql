-- title: Ends of callbacks without a start
-- description: Callbacks ended, but their start is not in the trace. They are left out.
-- cause: Tracing started inside a callback, or events were lost.
-- cure: Start the session before the nodes, and see whether events were lost (msgflow check).
-- grain: one row per trace
-- severity: warning
-- when: staging.callback_end_alone
SELECT
    trace_index + 1 AS trace_id,
    count(*) AS count,
    'ends of callbacks without a start: tracing started inside a callback, or events were lost'
        AS detail
FROM staging.callback_end_alone
GROUP BY trace_index
