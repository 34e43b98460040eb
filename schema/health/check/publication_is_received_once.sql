-- name: check.publication_is_received_once
-- description: A subscription receives a publication at most once by each way: through the ring
--     buffer of its process, and through the middleware, whose copy it drops.
-- grain: one row per publication and subscription with several takes of one way
-- severity: error
SELECT
    run_id, publication_id, subscription_id, method = 'ring_buffer' AS is_intra_process,
    count(*) AS take_count
FROM store.link_transport
WHERE subscription_id IS NOT NULL
GROUP BY run_id, publication_id, subscription_id, method = 'ring_buffer'
HAVING count(*) > 1
