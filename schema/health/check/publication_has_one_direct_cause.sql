-- name: check.publication_has_one_direct_cause
-- description: A publication is made inside at most one callback instance.
-- grain: one row per publication with several
-- severity: error
SELECT run_id, publication_id, count(*) AS link_count
FROM store.link_causal
WHERE kind = 'direct'
GROUP BY run_id, publication_id
HAVING count(*) > 1
