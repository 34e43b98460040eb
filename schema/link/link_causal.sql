-- name: derive.link_causal
-- description: What led to each publication, by every kind of link. A link may be spoilt by lost
--     events where a gap touches its run of a callback, or its take, or its publication.
-- grain: one row per run of a callback, or take outside of any, and publication that it led to, and
--     annotation of an indirect link
-- needs: derive.link_causal_direct, derive.link_causal_take_adjacent,
--     derive.link_causal_periodic_async, derive.link_causal_partial_sync,
--     store.callback_instance, store.take, store.publication
WITH link AS (
    SELECT
        run_id, callback_instance_id, NULL::BIGINT AS take_id, publication_id, 'direct' AS kind,
        NULL::BIGINT AS annotation_id, 1::BIGINT AS candidate_count, false AS is_loss_affected
    FROM derive.link_causal_direct
    UNION ALL
    SELECT run_id, NULL, take_id, publication_id, 'take_adjacent', NULL, 1, false
    FROM derive.link_causal_take_adjacent
    UNION ALL
    SELECT
        run_id, callback_instance_id, NULL, publication_id, 'periodic_async', annotation_id,
        candidate_count, is_loss_affected
    FROM derive.link_causal_periodic_async
    UNION ALL
    SELECT
        run_id, callback_instance_id, NULL, publication_id, 'partial_sync', annotation_id,
        candidate_count, is_loss_affected
    FROM derive.link_causal_partial_sync
)
-- By identities alone: with run_id as well, runs and publications might be joined by that first.
SELECT
    l.run_id,
    l.callback_instance_id,
    l.publication_id,
    t.take_id,
    t.subscription_id,
    b.publisher_id,
    l.kind,
    l.annotation_id,
    l.candidate_count,
    l.is_loss_affected
    OR coalesce(i.is_loss_affected, false)
    OR coalesce(l.take_id IS NOT NULL AND t.is_loss_affected, false)
    OR coalesce(b.is_loss_affected, false) AS is_loss_affected
FROM link AS l
LEFT JOIN store.callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
JOIN store.publication AS b ON l.publication_id = b.publication_id
LEFT JOIN store.take AS t ON coalesce(l.take_id, i.take_id) = t.take_id
