-- name: staging.take_origin
-- description: Every take with its subscription: by rmw handle or ring buffer, else by the callback
--     that it led to, known or not. A subscription callback that ran without any take traced was
--     handed its message all the same.
-- grain: one row per message handed over to a subscription
-- when: staging.take_subscription, staging.callback_binding
SELECT
    c.start_event_id,
    c.process_id,
    c.rmw_handle,
    coalesce(c.subscription_event_id, i.subscription_event_id, b.subscription_event_id)
        AS subscription_event_id,
    b.start_event_id AS callback_start_event_id
FROM staging.take_subscription AS c
LEFT JOIN staging.take_inferred AS i ON c.start_event_id = i.start_event_id
LEFT JOIN staging.callback_binding AS b ON c.start_event_id = b.take_event_id
UNION ALL
SELECT
    b.start_event_id,
    b.process_id,
    NULL,
    coalesce(b.subscription_event_id, i.subscription_event_id),
    b.start_event_id
FROM staging.callback_binding AS b
LEFT JOIN staging.take_inferred AS i ON b.start_event_id = i.start_event_id
WHERE b.take_event_id IS NULL AND (b.kind = 'subscription' OR b.is_intra_process)
