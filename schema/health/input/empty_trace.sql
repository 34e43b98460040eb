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
-- when: staging.trace WHERE event_count = 0
SELECT
    trace_id, 1 AS count,
    'no event was recorded' AS detail
FROM staging.trace
-- A chunk of a recording may well be empty, and of a copy nothing is read.
WHERE event_count = 0
    AND coalesce(uuid NOT IN (SELECT uuid FROM staging.trace WHERE event_count > 0), true)
