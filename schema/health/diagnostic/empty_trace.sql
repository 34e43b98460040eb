-- name: diagnostic.empty_trace
-- title: A trace is empty
-- description: A trace has metadata, but no events.
-- finding: empty_trace
-- grain: one row per trace
-- severity: warning
-- phase: reading
SELECT
    t.trace_id,
    1 AS count,
    'no event was recorded: ' || t.path AS detail
FROM staging.trace AS t
-- A chunk of a recording may well be empty, and of a copy nothing is read.
WHERE t.event_count = 0
    AND coalesce(t.uuid NOT IN (SELECT uuid FROM staging.trace WHERE event_count > 0), true)
