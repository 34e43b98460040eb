-- description: The subscription of each take: by rmw handle or ring buffer, else by the callback
--     that it led to, known or not.
-- grain: one row per message handed over to a subscription
-- when: staging.take_number
SELECT
    n.start_event_id, n.take_id, n.callback_start_event_id,
    coalesce(s.subscription_id, p.subscription_id) AS subscription_id
FROM staging.take_number AS n
LEFT JOIN staging.subscription AS s ON n.subscription_event_id = s.event_id
LEFT JOIN (
    SELECT process_id, rmw_handle, subscription_id FROM staging.subscription WHERE is_inferred
) AS p
    ON s.event_id IS NULL AND n.process_id = p.process_id AND n.rmw_handle = p.rmw_handle
