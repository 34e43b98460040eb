-- description: By what a file can name the clocks of a run: their UUID, and the hosts that they are
--     of.
-- grain: one row per clock
SELECT
    c.clock_id, c.uuid,
    list(h.hostname ORDER BY h.host_id) AS hostnames
FROM main.clock AS c
JOIN main.host AS h ON c.clock_id = h.clock_id
WHERE c.run_id = $run_id
GROUP BY c.clock_id, c.uuid
ORDER BY c.clock_id
