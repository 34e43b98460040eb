-- name: derive.link_transport
-- description: to come
-- grain: one row per take whose publication is known
-- needs: store.publication, store.take, store.publisher, store.subscription
SELECT 1::BIGINT AS run_id, 1::BIGINT AS publication_id, 1::BIGINT AS take_id, 'exact' AS method,
    1::BIGINT AS candidate_count, false AS is_self_loop, false AS is_loss_affected
WHERE false
