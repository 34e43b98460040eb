-- description: Subscriptions of ring buffers whose initialisation was not traced: what is taken out
--     of a buffer is for the callback that directly follows. One callback is one subscription,
--     which may be known; else it is a placeholder by the first dequeue. Where several callbacks
--     follow on one buffer, or one on several, the owner is not known (NULL).
-- grain: one row per process and ring buffer without a known subscription
-- when: raw.ros2_rclcpp_ring_buffer_dequeue
WITH dequeue AS (
    SELECT t.start_event_id, t.process_id, t.buffer_handle
    FROM staging.take_chain AS t
    WHERE t.method = 'ring_buffer' AND NOT t.is_known
),
used AS (
    SELECT DISTINCT
        d.process_id, d.buffer_handle, b.callback_handle, b.callback_event_id,
        b.subscription_event_id
    FROM dequeue AS d
    JOIN staging.callback_binding AS b ON d.start_event_id = b.take_event_id
),
reader AS (
    SELECT
        process_id, buffer_handle,
        count(*) AS callback_count,
        count(subscription_event_id) AS known_count,
        count(DISTINCT subscription_event_id) AS subscription_count,
        min(subscription_event_id) AS subscription_event_id,
        max(buffer_count) AS buffer_count
    FROM (
        SELECT
            *,
            count(*) OVER (
                PARTITION BY process_id, callback_handle, callback_event_id
            ) AS buffer_count
        FROM used
    )
    GROUP BY process_id, buffer_handle
),
buffer AS (
    SELECT process_id, buffer_handle, min(start_event_id) AS event_id
    FROM dequeue
    GROUP BY process_id, buffer_handle
)
SELECT
    b.process_id, b.buffer_handle,
    CASE
        WHEN r.subscription_count = 1 AND r.known_count = r.callback_count
            THEN r.subscription_event_id
        WHEN coalesce(r.callback_count = 1 AND r.buffer_count = 1, true) THEN b.event_id
    END AS subscription_event_id,
    coalesce(r.known_count = 0, true) AS is_inferred
FROM buffer AS b
LEFT JOIN reader AS r ON b.process_id = r.process_id AND b.buffer_handle = r.buffer_handle
