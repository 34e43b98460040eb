-- name: staging.take_origin
-- description: Every take with its subscription: by rmw handle or ring buffer, else by the callback
--     that it led to. A subscription callback that ran without any take traced was handed its
--     message all the same.
-- grain: one row per message handed over to a subscription
-- needs: staging.take_chain, staging.callback_binding, staging.callback_run,
--     staging.subscription_known, staging.buffer_subscription
WITH by_rmw AS (
    SELECT c.start_event_id, s.event_id AS subscription_event_id
    FROM staging.take_chain AS c
    ASOF JOIN staging.subscription_known AS s
        ON c.process_id = s.process_id
        AND c.rmw_handle = s.rmw_handle
        AND c.start_event_id >= s.event_id
),
by_buffer AS (
    SELECT c.start_event_id, b.subscription_event_id
    FROM staging.take_chain AS c
    ASOF JOIN staging.buffer_subscription AS b
        ON c.process_id = b.process_id
        AND c.buffer_handle = b.buffer_handle
        AND c.start_event_id >= b.event_id
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
    coalesce(r.subscription_event_id, f.subscription_event_id, b.subscription_event_id)
        AS subscription_event_id,
    b.start_event_id AS callback_start_event_id
FROM staging.take_chain AS c
LEFT JOIN by_rmw AS r ON c.start_event_id = r.start_event_id
LEFT JOIN by_buffer AS f ON c.start_event_id = f.start_event_id
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
    b.subscription_event_id,
    b.start_event_id
FROM staging.callback_binding AS b
JOIN staging.callback_run AS r ON b.start_event_id = r.start_event_id
WHERE b.take_event_id IS NULL AND (b.kind = 'subscription' OR b.is_intra_process)
