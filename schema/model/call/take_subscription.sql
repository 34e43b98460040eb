-- name: staging.take_subscription
-- description: The subscription of each take, by rmw handle or ring buffer, as initialised last
--     before the take.
-- grain: one row per take or dequeue whose subscription was initialised in the trace
-- needs: staging.take_chain, staging.subscription_known, staging.buffer_subscription
WITH known AS (
    SELECT
        event_id, process_id, rmw_handle,
        count(*) OVER (PARTITION BY process_id, rmw_handle) > 1 AS is_repeated
    FROM staging.subscription_known
)
-- Nearly every handle is used once: only the others need an order.
SELECT c.start_event_id, s.event_id AS subscription_event_id
FROM staging.take_chain AS c
JOIN known AS s
    ON c.process_id = s.process_id
    AND c.rmw_handle = s.rmw_handle
    AND c.start_event_id >= s.event_id
WHERE NOT s.is_repeated
UNION ALL
SELECT c.start_event_id, s.event_id
FROM (
    SELECT t.start_event_id, t.process_id, t.rmw_handle
    FROM staging.take_chain AS t
    SEMI JOIN (SELECT * FROM known WHERE is_repeated) AS r
        ON t.process_id = r.process_id AND t.rmw_handle = r.rmw_handle
) AS c
ASOF JOIN (SELECT * FROM known WHERE is_repeated) AS s
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
