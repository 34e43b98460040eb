-- name: staging.take_subscription
-- description: The subscription of each take, by rmw handle or ring buffer, as initialised last
--     before the take; NULL where that was not traced. Of a ring buffer, which one it belongs to
--     may be known (`is_known`), but not the subscription.
-- grain: one row per successful take or dequeue
-- when: staging.take_chain
WITH used AS NOT MATERIALIZED (
    SELECT start_event_id AS event_id, end_event_id, process_id, rmw_handle AS handle, method
    FROM staging.take_chain
    WHERE method <> 'ring_buffer'
),
subscription AS (
    SELECT event_id, process_id, rmw_handle AS handle FROM staging.subscription_known
)
SELECT
    event_id AS start_event_id,
    end_event_id,
    process_id,
    method,
    handle AS rmw_handle,
    NULL::UBIGINT AS buffer_handle,
    object_event_id AS subscription_event_id,
    object_event_id IS NOT NULL AS is_known
FROM staging.with_latest('used', 'subscription')
UNION ALL
SELECT
    c.start_event_id, c.end_event_id, c.process_id, c.method, NULL, c.buffer_handle,
    b.subscription_event_id, b.event_id IS NOT NULL
FROM (SELECT * FROM staging.take_chain WHERE method = 'ring_buffer') AS c
ASOF LEFT JOIN staging.buffer_subscription AS b
    ON c.process_id = b.process_id
    AND c.buffer_handle = b.buffer_handle
    AND c.start_event_id >= b.event_id
