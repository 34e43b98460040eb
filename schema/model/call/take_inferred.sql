-- description: The subscription of messages that did not come through the middleware, where its
--     initialisation was not traced: that of the ring buffer, else of the callback that was handed
--     the message without a traced take. A callback that none was traced for is a subscription of
--     its own, a placeholder by its first instance.
-- grain: one row per such take or callback instance
-- when: staging.buffer_owner, staging.callback_binding WHERE take_event_id IS NULL
--     AND subscription_event_id IS NULL
--     AND (kind = 'subscription' OR (is_intra_process AND coalesce(kind = 'unknown', true)))
WITH handed_over AS (
    SELECT start_event_id, process_id, callback_handle, callback_event_id
    FROM staging.callback_binding
    WHERE take_event_id IS NULL
        AND subscription_event_id IS NULL
        AND (kind = 'subscription' OR (is_intra_process AND coalesce(kind = 'unknown', true)))
),
dequeue AS (
    SELECT t.start_event_id, t.process_id, o.subscription_event_id, o.is_inferred
    FROM staging.take_chain AS t
    JOIN staging.buffer_owner AS o
        ON t.process_id = o.process_id AND t.buffer_handle = o.buffer_handle
    WHERE t.method = 'ring_buffer' AND NOT t.is_known AND o.subscription_event_id IS NOT NULL
),
callback AS (
    SELECT process_id, callback_handle, callback_event_id, min(start_event_id) AS event_id
    FROM handed_over
    GROUP BY process_id, callback_handle, callback_event_id
),
handed AS (
    SELECT
        b.process_id, b.callback_handle, b.callback_event_id,
        CASE WHEN bool_and(d.start_event_id IS NOT NULL) THEN min(d.subscription_event_id) END
            AS subscription_event_id,
        bool_and(d.is_inferred) AS is_inferred
    FROM staging.callback_binding AS b
    SEMI JOIN callback AS c ON b.process_id = c.process_id AND b.callback_handle = c.callback_handle
    LEFT JOIN dequeue AS d ON b.take_event_id = d.start_event_id
    WHERE b.take_event_id IS NOT NULL
    GROUP BY b.process_id, b.callback_handle, b.callback_event_id
)
SELECT start_event_id, process_id, subscription_event_id, is_inferred FROM dequeue
UNION ALL
SELECT
    l.start_event_id, l.process_id,
    CASE WHEN h.process_id IS NULL THEN c.event_id ELSE h.subscription_event_id END,
    coalesce(h.is_inferred, true)
FROM handed_over AS l
JOIN callback AS c
    ON l.process_id = c.process_id
    AND l.callback_handle = c.callback_handle
    AND l.callback_event_id IS NOT DISTINCT FROM c.callback_event_id
LEFT JOIN handed AS h
    ON l.process_id = h.process_id
    AND l.callback_handle = h.callback_handle
    AND l.callback_event_id IS NOT DISTINCT FROM h.callback_event_id
WHERE h.process_id IS NULL OR h.subscription_event_id IS NOT NULL
