-- name: check.take_has_one_publication
-- description: A take comes from at most one publication.
-- grain: one row per take with several
-- severity: error
-- needs: store.link_transport
SELECT take_id, count(*) AS link_count
FROM store.link_transport
GROUP BY take_id
HAVING count(*) > 1
