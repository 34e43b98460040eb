-- title: Hosts of clocks
-- description: What people call a clock.
-- grain: one row per clock
-- kind: inline
-- column: clock_id BIGINT  Clock
-- column: hosts VARCHAR  Its hosts
SELECT clock_id, string_agg(hostname, ', ' ORDER BY host_id) AS hosts
FROM main.host
GROUP BY clock_id
