-- description: What intra-process ring buffers were used for. An enqueue outside of any publish()
--     call is the replay of a message that was kept for a subscription that joined late. A buffer
--     that is made anew at an address is empty.
-- grain: one row per enqueue, dequeue or clearing of a ring buffer
-- when: raw.ros2_rclcpp_construct_ring_buffer, raw.ros2_rclcpp_ring_buffer_clear,
--     raw.ros2_rclcpp_ring_buffer_dequeue, raw.ros2_rclcpp_ring_buffer_enqueue
WITH enqueue AS (
    SELECT
        event_id, ts_ns, trace_index, process_id, thread_id, buffer,
        "index" AS slot,
        overwritten
    FROM staging.located('raw.ros2_rclcpp_ring_buffer_enqueue')
),
cleared AS (
    SELECT event_id, ts_ns, trace_index, thread_index, buffer FROM raw.ros2_rclcpp_ring_buffer_clear
    UNION ALL
    SELECT event_id, ts_ns, trace_index, thread_index, buffer
    FROM raw.ros2_rclcpp_construct_ring_buffer
),
published AS (
    SELECT e.event_id, b.publication_id
    FROM enqueue AS e
    ASOF JOIN (
        SELECT n.publication_id, c.thread_id, c.start_event_id, c.end_event_id
        FROM staging.publication_call AS c
        JOIN staging.publication_number AS n ON c.start_event_id = n.start_event_id
        WHERE c.intra_ns IS NOT NULL
    ) AS b
        ON e.thread_id = b.thread_id AND e.event_id > b.start_event_id
    WHERE e.event_id <= b.end_event_id
)
SELECT
    e.trace_index + 1 AS trace_id,
    e.process_id,
    'enqueue' AS kind,
    e.buffer AS buffer_handle,
    e.slot,
    e.ts_ns AS at_ns,
    b.publication_id,
    NULL::BIGINT AS take_id,
    coalesce(e.overwritten = 1, false) AS is_overwriting,
    e.event_id
FROM enqueue AS e
LEFT JOIN published AS b ON e.event_id = b.event_id
UNION ALL
SELECT
    d.trace_index + 1,
    d.process_id, 'dequeue', d.buffer, d."index", d.ts_ns, NULL, t.take_id, false, d.event_id
FROM staging.located('raw.ros2_rclcpp_ring_buffer_dequeue') AS d
LEFT JOIN staging.take_number AS t ON d.event_id = t.start_event_id
UNION ALL
SELECT
    trace_index + 1,
    process_id, 'clear', buffer, NULL, ts_ns, NULL, NULL, false, event_id
FROM staging.located('cleared')
ORDER BY event_id
