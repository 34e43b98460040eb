-- name: check.take_has_one_publication
-- description: A take comes from at most one publication.
-- grain: one row per take with several
-- severity: error
SELECT run_id, take_id, count(*) AS link_count
FROM store.link_transport
GROUP BY run_id, take_id
HAVING count(*) > 1
