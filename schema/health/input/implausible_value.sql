-- title: Values that make no sense
-- description: Values cannot be times or names. They were left out, their events kept.
-- cause: The recording machine lost power or space, the session was never stopped, or the files
--     were copied while they were written.
-- cure: Stop the session before copying (lttng stop, lttng destroy), check the free space, copy
--     again and compare sizes.
-- grain: one row per field of an event
-- severity: warning
-- when: staging.implausible
SELECT
    value_count AS count,
    printf('values of %s in %s that cannot be %s: left out', field, event, what) AS detail
FROM staging.implausible
