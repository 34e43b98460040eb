-- name: staging.placed_source
-- kind: inline
-- description: Traces with their clock and host, and what has to be added to their times
--     (`shift_ns`). All are as recorded, except for kernel traces that have a row in
--     staging.placement.
-- grain: one row per CTF trace
SELECT
    s.* REPLACE (
        CASE WHEN p.trace_index IS NULL THEN s.clock_key ELSE p.clock_key END AS clock_key,
        CASE WHEN p.trace_index IS NULL THEN s.hostname ELSE p.hostname END AS hostname
    ),
    CASE WHEN p.trace_index IS NULL THEN 0 ELSE p.shift_ns END AS shift_ns
FROM staging.source AS s
LEFT JOIN staging.placement AS p ON s.trace_index = p.trace_index
