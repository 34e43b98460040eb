-- description: The number of each take, in the order in which they began, and the callback that it
--     led to. A subscription callback that ran without any take traced was handed its message all
--     the same: then both are the same. The subscription may be known from either.
-- grain: one row per message handed over to a subscription
-- when: staging.take_chain, staging.callback_binding
WITH run AS (
    SELECT
        b.start_event_id, b.process_id, b.kind, b.is_intra_process, b.subscription_event_id,
        coalesce(b.take_event_id, h.take_event_id) AS take_event_id
    FROM staging.callback_binding AS b
    LEFT JOIN staging.callback_batch AS h ON b.start_event_id = h.start_event_id
),
every_take AS (
    SELECT
        c.start_event_id, c.process_id, c.rmw_handle, c.subscription_event_id,
        b.start_event_id AS callback_start_event_id,
        b.subscription_event_id AS callback_subscription_event_id
    FROM staging.take_chain AS c
    LEFT JOIN run AS b ON c.start_event_id = b.take_event_id
    UNION ALL
    SELECT start_event_id, process_id, NULL, NULL, start_event_id, subscription_event_id
    FROM run
    WHERE take_event_id IS NULL AND (kind = 'subscription' OR is_intra_process)
)
SELECT *, row_number() OVER (ORDER BY start_event_id) AS take_id FROM every_take
