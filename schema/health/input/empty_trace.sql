-- title: A trace is empty
-- description: The trace has metadata, but no events, and no other part of its recording was given.
--     What its host or process did is not known.
-- cause: Files of the trace were not copied. Or its nodes did not run, ran as another user than the
--     session, or run with a tracetools that was built without LTTng.
-- cure: Compare the files with those on the recording host. Of a trace of programs, ros2 run
--     tracetools status must say in the environment of the nodes that tracing is enabled; if it
--     does not, build tracetools with LTTng installed.
-- grain: one row per trace
-- severity: warning
-- when: staging.trace WHERE event_count = 0
SELECT
    trace_id, 1 AS count,
    CASE
        WHEN domain = 'ust' THEN 'no event was recorded'
        ELSE 'no event is there: its files are missing, or nothing was recorded'
    END AS detail
FROM staging.trace
-- A chunk of a recording may well be empty, and of a copy nothing is read.
WHERE event_count = 0
    AND coalesce(uuid NOT IN (SELECT uuid FROM staging.trace WHERE event_count > 0), true)
