-- name: derive.link_causal
-- description: What led to each publication, by every kind of link. A link may be spoilt by lost
--     events where a gap touches its run of a callback, or its take, or its publication.
-- grain: one row per run of a callback, or take outside of any, and publication that it led to
-- needs: derive.link_causal_direct, derive.link_causal_take_adjacent, store.callback_instance,
--     store.take, store.publication
WITH link AS (
    SELECT
        run_id, callback_instance_id, NULL::BIGINT AS take_id, publication_id, 'direct' AS kind,
        NULL::BIGINT AS annotation_id, 1::BIGINT AS candidate_count, false AS is_loss_affected
    FROM derive.link_causal_direct
    UNION ALL
    SELECT run_id, NULL, take_id, publication_id, 'take_adjacent', NULL, 1, false
    FROM derive.link_causal_take_adjacent
)
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
LEFT JOIN store.callback_instance AS i
    ON l.callback_instance_id = i.callback_instance_id AND l.run_id = i.run_id
JOIN store.publication AS b ON l.publication_id = b.publication_id AND l.run_id = b.run_id
LEFT JOIN store.take AS t ON coalesce(l.take_id, i.take_id) = t.take_id AND l.run_id = t.run_id
