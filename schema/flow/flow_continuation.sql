-- name: derive.flow_continuation
-- description: How flows go on through a node: from the take of a message to the publications that
--     the callback it was for led to, also by calling services: then with the route to the
--     publication (derive.flow_caller), else with an empty one.
-- grain: one row per take, publication that it led to, and way it did so
-- needs: store.link_causal, store.publisher, store.callback_instance, store.take,
--     derive.flow_caller
SELECT
    l.run_id, l.take_id, l.subscription_id, l.publication_id, l.publisher_id, l.kind,
    []::BIGINT[] AS route
FROM store.link_causal AS l
JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
WHERE l.take_id IS NOT NULL AND NOT p.is_internal
UNION ALL
SELECT
    l.run_id, i.take_id, t.subscription_id, l.publication_id, l.publisher_id, l.kind, c.route
FROM derive.flow_caller AS c
JOIN store.callback_instance AS i ON c.caller_id = i.callback_instance_id
JOIN store.take AS t ON i.take_id = t.take_id
JOIN store.link_causal AS l ON c.callback_instance_id = l.callback_instance_id
JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
WHERE NOT p.is_internal
