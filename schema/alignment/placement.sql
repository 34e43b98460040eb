-- description: The clock and host that kernel traces are of. Where one names no clock that a ROS
--     process has, its schedule tells the clock, and the name of a host there counts; a trace of
--     perf that no schedule proves is of the only clock there is. `shift_ns` has to be added to its
--     times.
-- grain: one row per kernel trace with a schedule
-- when: staging.schedule
WITH placed AS (
    SELECT
        trace_index, clock_key, shift_ns, is_joined,
        is_joined OR (
            SELECT count(DISTINCT clock_key) = 1
            FROM staging.source
            WHERE domain IS DISTINCT FROM 'kernel'
        ) AS is_placed
    FROM staging.schedule
)
SELECT
    s.trace_index,
    CASE WHEN p.is_placed THEN p.clock_key ELSE s.clock_key END AS clock_key,
    CASE WHEN p.is_placed AND s.hostname NOT IN (
        SELECT hostname FROM staging.source AS o WHERE o.clock_key = p.clock_key
    ) THEN (
        SELECT arg_min(hostname, trace_index)
        FROM staging.source AS o
        WHERE o.clock_key = p.clock_key AND o.domain IS DISTINCT FROM 'kernel'
    ) ELSE s.hostname END AS hostname,
    CASE WHEN p.is_joined THEN p.shift_ns ELSE 0 END AS shift_ns
FROM staging.source AS s
JOIN placed AS p ON s.trace_index = p.trace_index
