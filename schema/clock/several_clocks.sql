-- description: Runs with several clocks.
-- grain: one row per run
SELECT run_id FROM store.clock GROUP BY run_id HAVING count(*) > 1
