-- name: finding.damaged_trace
-- title: Files of the trace are damaged
-- description: Parts of the files could not be read: packets that are cut off, or bytes that make
--     no sense. Everything else was kept.
-- cause: The recording machine lost power or space, the session was never stopped, or the files
--     were copied while they were written.
-- cure: Stop the session before copying (lttng stop, lttng destroy), check the free space, copy
--     again and compare sizes.
-- grain: one row per damage, the first twenty of each trace, then one for the rest
-- severity: error
-- phase: reading
SELECT
    d.run_id,
    coalesce(t.path, 'the input') AS subject,
    d.count,
    d.detail
FROM main.diagnostic AS d
LEFT JOIN main.trace AS t ON d.trace_id = t.trace_id
WHERE d.name IN ('damaged_trace', 'implausible_value')
