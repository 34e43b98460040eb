-- description: What people call a clock.
-- grain: one row per clock
-- kind: inline
SELECT
    clock_id,
    string_agg(hostname, ', ' ORDER BY host_id) AS hosts
FROM main.host
GROUP BY clock_id
