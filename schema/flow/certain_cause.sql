-- name: derive.certain_cause
-- description: Causal links that flows follow. Links without a declaration are left out if they
--     have more than one candidate: the message may have led to nothing, or be of another process.
--     Indirect links are as true as their declaration, and are followed.
-- grain: one row per causal link that is followed
SELECT
    run_id, callback_instance_id, publication_id, take_id, subscription_id, publisher_id, kind,
    annotation_id, candidate_count, is_loss_affected
FROM store.link_causal
WHERE kind IN ('periodic_async', 'partial_sync') OR coalesce(candidate_count, 1) = 1
