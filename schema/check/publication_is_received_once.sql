-- name: check.publication_is_received_once
-- description: A subscription receives a publication at most once.
-- grain: one row per publication and subscription with several takes
-- severity: error
-- needs: store.link_transport
SELECT run_id, publication_id, subscription_id, count(*) AS take_count
FROM store.link_transport
WHERE subscription_id IS NOT NULL
GROUP BY run_id, publication_id, subscription_id
HAVING count(*) > 1
