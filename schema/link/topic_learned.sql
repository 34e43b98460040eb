-- name: derive.topic_learned
-- description: Topics that links by stamp alone tell of publishers and subscriptions whose
--     initialisation was not traced: the topic of the other side.
-- grain: one row per publisher or subscription without a topic of its own
-- needs: store.link_transport, store.publisher, store.subscription
SELECT
    l.run_id, 'publisher' AS kind, l.publisher_id AS id,
    mode(s.topic_name ORDER BY s.topic_name) AS topic_name,
    bool_and(s.is_internal) AS is_internal
FROM store.link_transport AS l
JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
JOIN store.subscription AS s ON l.subscription_id = s.subscription_id
WHERE l.method = 'exact_stamp' AND p.topic_name IS NULL
GROUP BY l.run_id, l.publisher_id
UNION ALL
SELECT
    l.run_id, 'subscription', l.subscription_id, mode(p.topic_name ORDER BY p.topic_name),
    bool_and(p.is_internal)
FROM store.link_transport AS l
JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
JOIN store.subscription AS s ON l.subscription_id = s.subscription_id
WHERE l.method = 'exact_stamp' AND s.topic_name IS NULL
GROUP BY l.run_id, l.subscription_id
