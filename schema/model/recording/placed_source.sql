-- description: Traces with the numbers of their clock, host and recording. A recording is one
--     trace, or all chunks or snapshots of one. A kernel trace is of the clock and host that its
--     schedule tells; all others are as recorded. `shift_ns` has to be added to the times of a
--     trace.
-- grain: one row per CTF trace
-- when: staging.source
WITH placed AS (
    SELECT
        s.* REPLACE (
            CASE WHEN p.trace_index IS NULL THEN s.clock_key ELSE p.placed_clock_key END
                AS clock_key,
            CASE WHEN p.trace_index IS NULL THEN s.hostname ELSE p.placed_hostname END AS hostname
        ),
        coalesce(p.placed_shift_ns, 0) AS shift_ns
    FROM staging.source AS s
    LEFT JOIN staging.schedule AS p ON s.trace_index = p.trace_index
),
first AS (
    SELECT
        *,
        min(trace_index) OVER (PARTITION BY clock_key) AS first_of_clock,
        min(trace_index) OVER (PARTITION BY clock_key, hostname) AS first_of_host,
        min(trace_index) OVER (PARTITION BY coalesce(uuid, path)) AS recording_index
    FROM placed
)
SELECT
    * EXCLUDE (first_of_clock, first_of_host),
    dense_rank() OVER (ORDER BY first_of_clock) AS clock_id,
    dense_rank() OVER (ORDER BY first_of_host) AS host_id
FROM first
