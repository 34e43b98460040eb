-- name: derive.flow_continuation
-- description: How flows go on through a node: from the take of a message to the publications that
--     the callback it was for led to.
-- grain: one row per take and publication that it led to
-- needs: store.link_causal, store.publisher
SELECT l.run_id, l.take_id, l.subscription_id, l.publication_id, l.publisher_id, l.kind
FROM store.link_causal AS l
JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
WHERE l.take_id IS NOT NULL AND NOT p.is_internal
