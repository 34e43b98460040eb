-- name: staging.take_chain
-- description: Layers of one take stitched together, as for publications. A chain whose rmw take
--     failed is none, although upper layers may report it. One without rcl take is the
--     middleware's own, where its reader belongs to no rcl subscription although rcl takes are
--     traced.
-- grain: one row per successful take or dequeue
-- needs: staging.thread_event, staging.thread_gap, staging.thread, staging.subscription_known
WITH layer AS (
    SELECT
        e.event_id, e.ts_ns, e.trace_index, e.thread_id, e.kind, e.handle, e.value,
        coalesce(CASE
            WHEN g.event_id IS NOT NULL THEN false
            WHEN e.kind IN ('rmw_take', 'rmw_take_failed') THEN
                e.previous_kind = 'dds_read' AND e.is_same_message
            WHEN e.kind = 'rcl_take' THEN
                e.previous_kind IN ('rmw_take', 'rmw_take_failed')
                AND e.is_same_message
            WHEN e.kind = 'rclcpp_take' THEN
                e.previous_kind IN ('rmw_take', 'rmw_take_failed', 'rcl_take')
                AND e.is_same_message
            WHEN e.kind = 'caret_take' THEN
                e.previous_kind IN ('rmw_take', 'rcl_take', 'rclcpp_take')
                AND e.is_same_message
            ELSE false
        END, false) AS continues
    FROM staging.thread_event AS e
    LEFT JOIN staging.thread_gap AS g ON e.event_id = g.event_id
    WHERE e.kind IN (
        'dds_read', 'rmw_take', 'rmw_take_failed', 'rcl_take', 'rclcpp_take', 'caret_take',
        'dequeue'
    )
),
chained AS (
    SELECT
        event_id, ts_ns, trace_index, thread_id, kind, handle, value,
        max(CASE WHEN NOT continues THEN event_id END) OVER (
            PARTITION BY thread_id ORDER BY event_id ROWS UNBOUNDED PRECEDING
        ) AS chain_id
    FROM layer
),
chain AS (
    SELECT
        chain_id AS start_event_id,
        max(event_id) AS end_event_id,
        any_value(trace_index) AS trace_index,
        any_value(thread_id) AS thread_id,
        max(CASE WHEN kind = 'rmw_take' THEN ts_ns END) AS rmw_ns,
        max(CASE WHEN kind = 'rcl_take' THEN ts_ns END) AS rcl_ns,
        max(CASE WHEN kind = 'caret_take' THEN ts_ns END) AS caret_ns,
        max(CASE WHEN kind = 'dequeue' THEN ts_ns END) AS dequeue_ns,
        max(CASE WHEN kind = 'rmw_take' THEN handle END) AS rmw_handle,
        max(CASE WHEN kind = 'caret_take' THEN handle END) AS callback_handle,
        max(CASE WHEN kind = 'dequeue' THEN handle END) AS buffer_handle,
        max(CASE WHEN kind IN ('rmw_take', 'caret_take') AND value <> 0 THEN value END)
            AS source_timestamp_ns
    FROM chained
    GROUP BY chain_id
    HAVING bool_and(kind <> 'rmw_take_failed')
),
known_reader AS (
    SELECT DISTINCT process_id, rmw_handle FROM staging.subscription_known
),
rcl_traced AS (
    SELECT DISTINCT t.process_id
    FROM chain AS c
    JOIN staging.thread AS t ON c.thread_id = t.thread_id
    WHERE c.rcl_ns IS NOT NULL
)
SELECT
    c.start_event_id,
    c.end_event_id,
    c.trace_index,
    c.thread_id,
    t.process_id,
    coalesce(c.dequeue_ns, c.rmw_ns, c.rcl_ns, c.caret_ns) AS taken_ns,
    CASE
        WHEN c.dequeue_ns IS NOT NULL THEN 'ring_buffer'
        WHEN c.rmw_ns IS NULL AND c.rcl_ns IS NULL THEN 'caret'
        ELSE 'rmw'
    END AS method,
    c.rmw_handle,
    c.callback_handle,
    c.buffer_handle,
    c.source_timestamp_ns
FROM chain AS c
JOIN staging.thread AS t ON c.thread_id = t.thread_id
LEFT JOIN rcl_traced AS r ON t.process_id = r.process_id
LEFT JOIN known_reader AS k ON t.process_id = k.process_id AND c.rmw_handle = k.rmw_handle
WHERE c.dequeue_ns IS NOT NULL
    OR c.rcl_ns IS NOT NULL
    OR c.caret_ns IS NOT NULL
    OR (
        c.rmw_ns IS NOT NULL
        AND c.source_timestamp_ns IS NOT NULL
        AND (k.process_id IS NOT NULL OR r.process_id IS NULL)
    )
