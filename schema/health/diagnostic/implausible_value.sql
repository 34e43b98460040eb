-- name: diagnostic.implausible_value
-- title: Values that make no sense
-- description: Values cannot be times or names. They were left out, their events kept.
-- finding: damaged_trace
-- grain: one row per field of an event
-- severity: data_loss
-- phase: reading
SELECT
    NULL AS trace_id,
    value_count AS count,
    printf('values of %s in %s that cannot be %s: left out', field, event, what) AS detail
FROM staging.implausible
