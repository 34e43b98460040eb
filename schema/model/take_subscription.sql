-- name: staging.take_subscription
-- description: The subscription of each take, by rmw handle or ring buffer, as initialised last
--     before the take.
-- grain: one row per take or dequeue whose subscription was initialised in the trace
-- needs: staging.take_chain, staging.subscription_known, staging.buffer_subscription
SELECT c.start_event_id, s.event_id AS subscription_event_id
FROM staging.take_chain AS c
ASOF JOIN staging.subscription_known AS s
    ON c.process_id = s.process_id
    AND c.rmw_handle = s.rmw_handle
    AND c.start_event_id >= s.event_id
UNION ALL
SELECT c.start_event_id, b.subscription_event_id
FROM staging.take_chain AS c
ASOF JOIN staging.buffer_subscription AS b
    ON c.process_id = b.process_id
    AND c.buffer_handle = b.buffer_handle
    AND c.start_event_id >= b.event_id
