-- name: staging.placed_source
-- kind: inline
-- description: Traces with the clock and host that they are of. Where a kernel trace names no clock
--     that a ROS process has, its schedule tells the clock, and the name of a host there counts; a
--     trace of perf that no schedule proves is of the only clock there is.
-- grain: one row per CTF trace
SELECT
    s.* REPLACE (
        CASE WHEN d.is_placed THEN d.clock_key ELSE s.clock_key END AS clock_key,
        CASE WHEN d.is_placed AND s.hostname NOT IN (
            SELECT hostname FROM staging.source AS o WHERE o.clock_key = d.clock_key
        ) THEN (
            SELECT arg_min(hostname, trace_index)
            FROM staging.source AS o
            WHERE o.clock_key = d.clock_key AND o.domain IS DISTINCT FROM 'kernel'
        ) ELSE s.hostname END AS hostname
    ),
    CASE WHEN d.is_joined THEN d.shift_ns ELSE 0 END AS shift_ns
FROM staging.source AS s
LEFT JOIN (
    SELECT
        trace_index, clock_key, shift_ns, is_joined,
        is_joined OR (
            SELECT count(DISTINCT clock_key) = 1
            FROM staging.source
            WHERE domain IS DISTINCT FROM 'kernel'
        ) AS is_placed
    FROM staging.schedule
) AS d ON s.trace_index = d.trace_index
