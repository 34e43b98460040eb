-- description: How flows go on through a node: from the take of a message to the publications
--     that the callback of this take led to. It may have led to them by calling services: then
--     the route to the publication is given (derive.flow_caller), else an empty one. It is
--     ambiguous where another message may have led to the publication instead.
-- grain: one row per take, publication that it led to, and way it did so
SELECT
    l.run_id, l.take_id, l.subscription_id, l.publication_id, l.publisher_id, l.kind,
    []::BIGINT[] AS route,
    coalesce(l.candidate_count > 1, false) AS is_ambiguous
FROM derive.certain_cause AS l
JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
WHERE l.take_id IS NOT NULL AND NOT p.is_internal
UNION ALL
SELECT
    l.run_id, l.take_id, l.subscription_id, l.publication_id, l.publisher_id, l.kind, l.route, false
FROM store.flow_call AS l
JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
WHERE l.take_id IS NOT NULL AND NOT p.is_internal
