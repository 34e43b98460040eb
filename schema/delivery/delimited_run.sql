-- description: Runs with both events between which executors wait: that they wait, and that they
--     look for work. Where a recording leaves out one of them, the next event of a thread does not
--     show how long its state lasted.
-- grain: one row per such run
SELECT run_id
FROM store.executor_state
WHERE state IN ('wait', 'process')
GROUP BY run_id
HAVING min(state) <> max(state)
