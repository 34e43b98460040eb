-- description: Subscriptions of action clients to the states of goals. Where one was created before
--     the recording, its topic alone tells.
-- grain: one row per such subscription
SELECT object_id AS subscription_id
FROM derive.action_endpoint
WHERE kind = 'subscription' AND part = 'status' AND created_ns IS NULL
UNION ALL
SELECT status_object_id
FROM derive.action_object('client', 'subscription')
WHERE status_object_id IS NOT NULL
