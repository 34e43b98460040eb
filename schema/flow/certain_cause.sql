-- name: derive.certain_cause
-- description: Causal links that flows follow. Left out are those where the message may have led to
--     nothing. An indirect link with several candidates is followed: one of the messages is right.
-- grain: one row per causal link that is followed
SELECT
    run_id, callback_instance_id, publication_id, take_id, subscription_id, publisher_id, kind,
    annotation_id, candidate_count, is_loss_affected
FROM store.link_causal
WHERE kind IN ('periodic_async', 'partial_sync') OR coalesce(candidate_count, 1) = 1
