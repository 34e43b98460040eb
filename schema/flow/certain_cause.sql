-- description: Causal links that flows follow.
-- grain: one row per causal link that is followed
SELECT
    run_id, callback_instance_id, publication_id, take_id, subscription_id, publisher_id, kind,
    annotation_id, candidate_count, is_loss_affected
FROM store.link_causal
WHERE derive.is_followed(kind, candidate_count)
