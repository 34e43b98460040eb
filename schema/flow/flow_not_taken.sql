-- name: derive.flow_not_taken
-- description: Messages that a subscription of their topic did not get, with the reason as far as
--     it is known.
-- grain: one row per publication and subscription of its topic that did not take it
-- needs: store.publication, store.publisher, store.subscription, store.link_transport
SELECT
    b.run_id, b.publication_id, s.subscription_id,
    CASE WHEN s.created_ns > b.end_ns THEN 'before_subscription' END AS reason
FROM store.publication AS b
JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
JOIN store.subscription AS s ON b.run_id = s.run_id AND p.topic_name = s.topic_name
ANTI JOIN store.link_transport AS l
    ON b.publication_id = l.publication_id AND s.subscription_id = l.subscription_id
