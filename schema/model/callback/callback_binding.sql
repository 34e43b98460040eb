-- name: staging.callback_binding
-- description: Callback instances with their callback object and the take that they were called
--     with. The callback_start directly follows the take's last layer on its thread, with no event
--     of the executor between the two; an rmw take is not for an intra-process call, nor a dequeue
--     for another; the subscriptions agree where both are known.
-- grain: one row per callback_start
-- needs: staging.callback_run, staging.callback_known, staging.take_chain,
--     staging.take_subscription
WITH known AS (
    SELECT
        event_id, process_id, callback_handle, kind, subscription_event_id,
        count(*) OVER (PARTITION BY process_id, callback_handle) > 1 AS is_repeated
    FROM staging.callback_known
),
-- Nearly every address is used once: only the others need an order.
repeated AS (
    SELECT r.start_event_id, k.event_id
    FROM (
        SELECT u.start_event_id, u.process_id, u.callback_handle
        FROM staging.callback_run AS u
        SEMI JOIN (SELECT * FROM known WHERE is_repeated) AS o
            ON u.process_id = o.process_id AND u.callback_handle = o.callback_handle
    ) AS r
    ASOF JOIN (SELECT * FROM known WHERE is_repeated) AS k
        ON r.process_id = k.process_id
        AND r.callback_handle = k.callback_handle
        AND r.start_event_id >= k.event_id
),
run AS (
    SELECT
        r.start_event_id, r.process_id, r.callback_handle, r.is_intra_process,
        r.previous_event_id, r.previous_executor_event_id, k.event_id AS callback_event_id,
        k.kind, k.subscription_event_id
    FROM staging.callback_run AS r
    LEFT JOIN repeated AS o ON r.start_event_id = o.start_event_id
    LEFT JOIN known AS k
        ON r.process_id = k.process_id
        AND r.callback_handle = k.callback_handle
        AND r.start_event_id >= k.event_id
        AND (NOT k.is_repeated OR k.event_id = o.event_id)
),
taken AS (
    SELECT c.start_event_id, c.end_event_id, c.method, s.subscription_event_id
    FROM staging.take_chain AS c
    LEFT JOIN staging.take_subscription AS s ON c.start_event_id = s.start_event_id
),
bound AS (
    SELECT
        r.start_event_id,
        t.start_event_id AS take_event_id,
        t.subscription_event_id
    FROM run AS r
    JOIN taken AS t ON r.previous_event_id = t.end_event_id
    -- As recorded: what the executor said after the take stands, whatever else was lost. It is NULL
    -- only where the thread had no executor event at all.
    WHERE (r.previous_executor_event_id IS NULL OR r.previous_executor_event_id < t.end_event_id)
        AND r.is_intra_process = (t.method = 'ring_buffer')
        AND r.kind IS DISTINCT FROM 'timer'
        AND r.kind IS DISTINCT FROM 'service'
        AND coalesce(r.subscription_event_id = t.subscription_event_id, true)
)
SELECT
    r.start_event_id,
    r.process_id,
    r.callback_handle,
    r.is_intra_process,
    r.callback_event_id,
    r.kind,
    b.take_event_id,
    coalesce(r.subscription_event_id, b.subscription_event_id) AS subscription_event_id
FROM run AS r
LEFT JOIN bound AS b ON r.start_event_id = b.start_event_id
