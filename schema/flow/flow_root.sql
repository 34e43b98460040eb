-- name: derive.flow_root
-- description: Where the flow of each publication can be said to begin: with the callback instance
--     of the timer (or other callback without a message) that published it or called the service
--     that did, else with the publication itself. It is a source where no taken message led to it.
--     The route (derive.flow_caller) is that from an instance that called; else it is empty.
-- grain: one row per publication on a topic of the application
-- needs: store.publication, store.publisher, store.link_causal, store.callback_instance,
--     derive.flow_caller
WITH called AS (
    SELECT l.run_id, l.publication_id, i.callback_instance_id, i.take_id, c.route
    FROM store.link_causal AS l
    JOIN derive.flow_caller AS c ON l.callback_instance_id = c.callback_instance_id
    JOIN store.callback_instance AS i ON c.caller_id = i.callback_instance_id
    ANTI JOIN derive.flow_caller AS f ON c.caller_id = f.callback_instance_id
),
run AS (
    SELECT l.run_id, l.publication_id, l.callback_instance_id, l.take_id
    FROM store.link_causal AS l
    ANTI JOIN derive.flow_caller AS c ON l.callback_instance_id = c.callback_instance_id
    UNION ALL
    SELECT run_id, publication_id, callback_instance_id, take_id FROM called
),
cause AS (
    SELECT
        run_id,
        publication_id,
        bool_or(take_id IS NOT NULL) AS has_message,
        min(CASE WHEN take_id IS NULL THEN callback_instance_id END) AS callback_instance_id
    FROM run
    GROUP BY run_id, publication_id
),
route AS (
    SELECT publication_id, callback_instance_id, min(route) AS route
    FROM called
    GROUP BY publication_id, callback_instance_id
)
SELECT
    b.run_id,
    b.publication_id,
    b.publisher_id,
    NOT coalesce(c.has_message, false) AS is_source,
    CASE WHEN c.callback_instance_id IS NULL OR c.has_message THEN 'publication'
        ELSE 'callback_instance' END AS root_kind,
    CASE WHEN c.callback_instance_id IS NULL OR c.has_message THEN b.publication_id
        ELSE c.callback_instance_id END AS root_id,
    CASE WHEN c.has_message THEN []::BIGINT[] ELSE coalesce(r.route, []) END AS route
FROM store.publication AS b
JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
LEFT JOIN cause AS c ON b.publication_id = c.publication_id
LEFT JOIN route AS r
    ON c.publication_id = r.publication_id AND c.callback_instance_id = r.callback_instance_id
WHERE NOT p.is_internal
