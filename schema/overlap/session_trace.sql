-- description: Host of each trace, and session on that host. A session is all traces of one uuid.
-- grain: one row per trace
SELECT
    trace_index,
    dense_rank() OVER (ORDER BY clock_key, hostname) AS host,
    dense_rank() OVER (ORDER BY clock_key, hostname, coalesce(uuid, '')) AS session
FROM staging.source
