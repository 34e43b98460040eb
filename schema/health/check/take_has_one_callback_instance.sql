-- name: check.take_has_one_callback_instance
-- description: A take leads to at most one callback instance.
-- grain: one row per take with several
-- severity: error
SELECT run_id, take_id, count(*) AS run_count
FROM store.callback_instance
WHERE take_id IS NOT NULL
GROUP BY run_id, take_id
HAVING count(*) > 1
