-- name: check.request_has_one_callback_instance
-- description: A request leads to at most one callback instance, and both say so.
-- grain: one row per request and callback instance that do not agree
-- severity: error
SELECT
    coalesce(q.run_id, i.run_id) AS run_id, coalesce(q.request_id, i.request_id) AS request_id,
    i.callback_instance_id
FROM store.request AS q
FULL JOIN (SELECT * FROM store.callback_instance WHERE request_id IS NOT NULL) AS i
    ON q.request_id = i.request_id
WHERE q.callback_instance_id IS DISTINCT FROM i.callback_instance_id
