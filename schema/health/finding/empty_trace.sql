-- name: finding.empty_trace
-- title: A trace is empty
-- description: The trace has metadata, but no events, and no other part of its recording was given.
--     What its host or process did is not known.
-- cause: Its nodes did not run, ran as another user than the session, or run with a tracetools that
--     was built without LTTng; or files of the trace were not copied.
-- cure: In the environment of the nodes, ros2 run tracetools status must say that tracing is
--     enabled; if it does not, build tracetools with LTTng installed. Compare the files with those
--     on the recording host.
-- grain: one row per trace
-- severity: warning
-- phase: reading
SELECT
    t.run_id,
    t.path AS subject,
    d.count,
    'no event was recorded' AS detail
FROM main.diagnostic AS d
JOIN main.trace AS t ON d.trace_id = t.trace_id
WHERE d.name = 'empty_trace'
