-- name: staging.take_subscription
-- description: The subscription of each take, by rmw handle or ring buffer, as initialised last
--     before the take.
-- grain: one row per take or dequeue whose subscription was initialised in the trace
-- needs: staging.take_chain, staging.subscription_known, staging.buffer_subscription,
--     staging.with_latest
WITH used AS NOT MATERIALIZED (
    SELECT start_event_id AS event_id, process_id, rmw_handle AS handle FROM staging.take_chain
),
subscription AS (
    SELECT event_id, process_id, rmw_handle AS handle FROM staging.subscription_known
)
SELECT event_id AS start_event_id, object_event_id AS subscription_event_id
FROM staging.with_latest('used', 'subscription')
WHERE object_event_id IS NOT NULL
UNION ALL
SELECT c.start_event_id, b.subscription_event_id
FROM staging.take_chain AS c
ASOF JOIN staging.buffer_subscription AS b
    ON c.process_id = b.process_id
    AND c.buffer_handle = b.buffer_handle
    AND c.start_event_id >= b.event_id
