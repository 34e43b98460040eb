-- name: derive.flow_end
-- description: Where flows end because the other side of a message is missing, with the reason as
--     far as it is known: messages that a subscription of their topic did not take, and takes whose
--     publication is not known.
-- grain: one row per publication and subscription of its topic that did not take it, and one per
--     take without a publication
-- needs: store.publication, store.publisher, store.subscription, store.take, store.link_transport
SELECT
    b.run_id,
    'publication' AS kind,
    b.publication_id AS id,
    s.subscription_id,
    CASE WHEN s.created_ns > b.end_ns THEN 'before_subscription' END AS reason
FROM store.publication AS b
JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
JOIN store.subscription AS s ON b.run_id = s.run_id AND p.topic_name = s.topic_name
ANTI JOIN store.link_transport AS l
    ON b.publication_id = l.publication_id AND s.subscription_id = l.subscription_id
UNION ALL
SELECT t.run_id, 'take', t.take_id, t.subscription_id, NULL
FROM store.take AS t
ANTI JOIN store.link_transport AS l ON t.take_id = l.take_id
