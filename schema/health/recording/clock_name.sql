-- kind: inline
-- description: How clocks are named in details, if messages were to bring those of the run
--     together.
-- grain: one row per clock of the run
SELECT
    h.clock_id,
    string_agg(h.hostname, ', ' ORDER BY h.host_id) AS name
FROM store.host AS h
JOIN derive.clocks_to_synchronise AS r ON h.run_id = r.run_id
WHERE h.run_id = $run_id
GROUP BY h.clock_id
