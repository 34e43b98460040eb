-- description: Clocks that a kernel trace may have used, and what has to be added to its times in
--     each case. LTTng names the clock. perf names none: its times count from the origin of the
--     clock, or from the epoch.
-- grain: one row per kernel trace, clock of a ROS process, and shift
-- when: raw.sched_switch
WITH kernel AS (
    SELECT
        s.trace_index, s.clock_key, s.clock_origin_ns,
        count(w.cpu_id) > 0 AS has_cpus
    FROM raw.sched_switch AS w
    JOIN staging.source AS s ON w.trace_index = s.trace_index
    GROUP BY ALL
),
ros AS (
    SELECT
        clock_key,
        min(clock_origin_ns) AS clock_origin_ns
    FROM staging.source
    WHERE domain IS DISTINCT FROM 'kernel'
    GROUP BY clock_key
)
SELECT
    row_number() OVER (ORDER BY trace_index, clock_key, shift_ns) AS candidate_number,
    trace_index, clock_key, shift_ns, has_cpus
FROM (
    SELECT DISTINCT
        k.trace_index, r.clock_key,
        CASE WHEN k.clock_key = r.clock_key OR s.is_of_epoch THEN 0
            ELSE r.clock_origin_ns - k.clock_origin_ns END AS shift_ns,
        k.has_cpus
    FROM kernel AS k
    JOIN ros AS r ON k.clock_key = r.clock_key OR k.clock_key NOT IN (SELECT clock_key FROM ros)
    CROSS JOIN (VALUES (false), (true)) AS s (is_of_epoch)
)
