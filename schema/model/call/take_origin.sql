-- name: staging.take_origin
-- description: Every take with its subscription: by rmw handle or ring buffer, else by the callback
--     that it led to, known or not. A subscription callback that ran without any take traced was
--     handed its message all the same.
-- grain: one row per message handed over to a subscription
-- needs: staging.take_chain, staging.take_subscription, staging.take_inferred,
--     staging.callback_binding, staging.callback_run
WITH found AS (
    SELECT start_event_id, subscription_event_id FROM staging.take_subscription
    UNION ALL
    SELECT start_event_id, subscription_event_id FROM staging.take_inferred
)
SELECT
    c.start_event_id,
    c.end_event_id,
    c.trace_index,
    c.thread_id,
    c.process_id,
    c.taken_ns,
    c.method,
    c.rmw_handle,
    c.source_timestamp_ns,
    coalesce(s.subscription_event_id, b.subscription_event_id) AS subscription_event_id,
    b.start_event_id AS callback_start_event_id
FROM staging.take_chain AS c
LEFT JOIN found AS s ON c.start_event_id = s.start_event_id
LEFT JOIN staging.callback_binding AS b ON c.start_event_id = b.take_event_id
UNION ALL
SELECT
    b.start_event_id,
    b.start_event_id,
    r.trace_index,
    r.thread_id,
    r.process_id,
    r.start_ns,
    'callback_only',
    NULL,
    NULL,
    coalesce(b.subscription_event_id, i.subscription_event_id),
    b.start_event_id
FROM staging.callback_binding AS b
JOIN staging.callback_run AS r ON b.start_event_id = r.start_event_id
LEFT JOIN staging.take_inferred AS i ON b.start_event_id = i.start_event_id
WHERE b.take_event_id IS NULL AND (b.kind = 'subscription' OR b.is_intra_process)
