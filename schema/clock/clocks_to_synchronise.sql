-- description: Runs with several clocks, for which synchronisation by messages was asked.
-- grain: one row per run
SELECT s.run_id
FROM derive.several_clocks AS s
JOIN store.run AS r ON s.run_id = r.run_id
WHERE r.clock_sync = 'messages'
