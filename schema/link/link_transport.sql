-- name: derive.link_transport
-- description: Messages from publication to take, by every method. A node that takes its own
--     transform, or whose process's transform listener does, is a self loop: no flow passes
--     through it. Links by equal stamps cannot be spoilt by lost events.
-- grain: one row per take whose publication is known
-- needs: derive.link_transport_exact, store.publication, store.publisher, store.take,
--     store.subscription, store.node
SELECT
    l.run_id,
    l.publication_id,
    l.take_id,
    b.publisher_id,
    t.subscription_id,
    l.method,
    l.candidate_count,
    coalesce(
        p.topic_name IN ('/tf', '/tf_static')
        AND (
            p.node_id = s.node_id
            OR (p.process_id = s.process_id AND starts_with(n.name, 'transform_listener_impl'))
        ),
        false
    ) AS is_self_loop,
    false AS is_loss_affected
FROM derive.link_transport_exact AS l
JOIN store.publication AS b ON l.publication_id = b.publication_id AND l.run_id = b.run_id
LEFT JOIN store.publisher AS p ON b.publisher_id = p.publisher_id AND b.run_id = p.run_id
JOIN store.take AS t ON l.take_id = t.take_id AND l.run_id = t.run_id
LEFT JOIN store.subscription AS s
    ON t.subscription_id = s.subscription_id AND t.run_id = s.run_id
LEFT JOIN store.node AS n ON s.node_id = n.node_id AND s.run_id = n.run_id
