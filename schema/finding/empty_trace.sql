-- name: finding.empty_trace
-- title: A trace is empty
-- description: The trace has metadata, but not one event, and no other part of its recording is
--     given. What its host or process did is not known.
-- cause: The nodes that it was made for run with a tracetools that was built without LTTng, as
--     another user than the session, or not at all; or files of it were not copied.
-- cure: In the environment of the nodes, ros2 run tracetools status must say that tracing is
--     enabled; build tracetools with LTTng installed where it does not. Compare the files with
--     those of the recording host.
-- grain: one row per trace
-- severity: warning
-- needs: main.diagnostic, main.trace
SELECT
    t.run_id,
    t.path AS subject,
    d.count,
    'not one event was recorded' AS detail
FROM main.diagnostic AS d
JOIN main.trace AS t ON d.trace_id = t.trace_id
WHERE d.name = 'empty_trace'
