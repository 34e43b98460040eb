-- description: Subscriptions and publishers that flows go on through, whatever the message: the
--     pairs of derive.flow_continuation, which are much cheaper to find than its rows.
-- grain: one row per subscription and publisher that a message of it led to
WITH pair AS (
    SELECT DISTINCT run_id, subscription_id, publisher_id
    FROM derive.certain_cause
    WHERE take_id IS NOT NULL
    UNION
    SELECT run_id, subscription_id, publisher_id FROM store.flow_call WHERE take_id IS NOT NULL
)
SELECT p.run_id, p.subscription_id, p.publisher_id
FROM pair AS p
JOIN store.publisher AS u ON p.publisher_id = u.publisher_id
WHERE NOT u.is_internal
