-- name: derive.link_causal
-- description: to come
-- grain: one row per callback run that led to a publication
-- needs: store.publication
SELECT 1::BIGINT AS run_id, 1::BIGINT AS publication_id, 1::BIGINT AS callback_instance_id, 'direct' AS kind,
    1::BIGINT AS annotation_id, 1::BIGINT AS candidate_count, false AS is_loss_affected
WHERE false
