-- name: derive.continued_pair
-- description: Subscriptions and publishers that flows go on through, whatever the message: the
--     pairs of derive.flow_continuation, which are much cheaper to find than its rows.
-- grain: one row per subscription and publisher that a message of it led to
WITH pair AS (
    SELECT DISTINCT run_id, subscription_id, publisher_id
    FROM store.link_causal
    WHERE take_id IS NOT NULL
    UNION
    SELECT l.run_id, t.subscription_id, l.publisher_id
    FROM derive.flow_caller AS c
    JOIN store.callback_instance AS i ON c.caller_id = i.callback_instance_id
    JOIN store.take AS t ON i.take_id = t.take_id
    JOIN store.link_causal AS l ON c.callback_instance_id = l.callback_instance_id
)
SELECT p.run_id, p.subscription_id, p.publisher_id
FROM pair AS p
JOIN store.publisher AS u ON p.publisher_id = u.publisher_id
WHERE NOT u.is_internal
