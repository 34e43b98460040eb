-- name: staging.thread_event
-- description: What threads do at run time, executors apart: each event with the one directly
--     before it on its thread, and whether both are about the same object (`handle`) and were
--     given the same message (NULL: not known). `value` is the source stamp (of callback_start:
--     is_intra_process). Initialisation is left out, and so is every provider that may stand
--     between two layers of one call by accident. Kept narrow: this is the largest table.
-- grain: one row per run-time event of a thread
-- needs: staging.context, raw
WITH runtime AS (
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'intra' AS kind,
        publisher_handle AS handle, message, NULL::BIGINT AS value
    FROM raw.ros2_rclcpp_intra_publish
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'enqueue' AS kind,
        buffer AS handle, NULL::UBIGINT AS message, NULL::BIGINT AS value
    FROM raw.ros2_rclcpp_ring_buffer_enqueue
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'rclcpp' AS kind,
        publisher_handle AS handle, message, NULL::BIGINT AS value
    FROM raw.ros2_rclcpp_publish
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'rcl' AS kind,
        publisher_handle AS handle, message, NULL::BIGINT AS value
    FROM raw.ros2_rcl_publish
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'rmw' AS kind,
        rmw_publisher_handle AS handle, message, timestamp::BIGINT AS value
    FROM raw.ros2_rmw_publish
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'dds_data' AS kind,
        writer AS handle, data AS message, NULL::BIGINT AS value
    FROM raw.dds_write_pre
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'dds' AS kind,
        writer AS handle, data AS message, timestamp::BIGINT AS value
    FROM raw.dds_write
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'caret_write' AS kind,
        NULL::UBIGINT AS handle, message, NULL::BIGINT AS value
    FROM raw.ros2_caret_dds_write
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'caret_copy' AS kind,
        NULL::UBIGINT AS handle, addr_from AS message, NULL::BIGINT AS value
    FROM raw.ros2_caret_dds_bind_addr_to_addr
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'caret_stamp' AS kind,
        NULL::UBIGINT AS handle, NULL::UBIGINT AS message, source_stamp::BIGINT AS value
    FROM raw.ros2_caret_dds_bind_addr_to_stamp
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'dds_read' AS kind,
        reader AS handle, buffer AS message, NULL::BIGINT AS value
    FROM raw.dds_read
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        CASE WHEN taken = 0 THEN 'rmw_take_failed' ELSE 'rmw_take' END AS kind,
        rmw_subscription_handle AS handle, message, source_timestamp AS value
    FROM raw.ros2_rmw_take
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'rcl_take' AS kind,
        NULL::UBIGINT AS handle, message, NULL::BIGINT AS value
    FROM raw.ros2_rcl_take
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'rclcpp_take' AS kind,
        NULL::UBIGINT AS handle, message, NULL::BIGINT AS value
    FROM raw.ros2_rclcpp_take
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'caret_take' AS kind,
        callback AS handle, message, source_stamp::BIGINT AS value
    FROM raw.ros2_dispatch_subscription_callback
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'dequeue' AS kind,
        buffer AS handle, NULL::UBIGINT AS message, NULL::BIGINT AS value
    FROM raw.ros2_rclcpp_ring_buffer_dequeue
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'callback_start' AS kind,
        callback AS handle, NULL::UBIGINT AS message, is_intra_process::BIGINT AS value
    FROM raw.ros2_callback_start
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'callback_end' AS kind,
        callback AS handle, NULL::UBIGINT AS message, NULL::BIGINT AS value
    FROM raw.ros2_callback_end
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'service' AS kind,
        NULL::UBIGINT AS handle, NULL::UBIGINT AS message, NULL::BIGINT AS value
    FROM raw.ros2_rmw_send_request
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'service' AS kind,
        NULL::UBIGINT AS handle, NULL::UBIGINT AS message, NULL::BIGINT AS value
    FROM raw.ros2_rmw_take_request
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'service' AS kind,
        NULL::UBIGINT AS handle, NULL::UBIGINT AS message, NULL::BIGINT AS value
    FROM raw.ros2_rmw_send_response
    UNION ALL
    SELECT
        event_id, ts_ns, trace_index, cpu_id, pid_ns, vpid, vtid,
        'service' AS kind,
        NULL::UBIGINT AS handle, NULL::UBIGINT AS message, NULL::BIGINT AS value
    FROM raw.ros2_rmw_take_response
),
located AS (
    SELECT
        r.event_id,
        r.ts_ns,
        r.trace_index,
        r.cpu_id,
        c.thread_id,
        r.kind::ENUM(
            'intra', 'enqueue', 'rclcpp', 'rcl', 'rmw', 'dds_data', 'dds', 'caret_write',
            'caret_copy', 'caret_stamp', 'dds_read', 'rmw_take', 'rmw_take_failed', 'rcl_take',
            'rclcpp_take', 'caret_take', 'dequeue', 'callback_start', 'callback_end', 'service'
        ) AS kind,
        r.handle,
        r.message,
        r.value
    FROM runtime AS r
    JOIN staging.context AS c
        ON r.trace_index = c.trace_index
        AND r.vpid = c.vpid
        AND r.vtid = c.vtid
        AND r.pid_ns IS NOT DISTINCT FROM c.pid_ns
        AND r.event_id >= c.from_event_id
        AND r.event_id < c.until_event_id
)
SELECT
    event_id,
    ts_ns,
    trace_index,
    cpu_id,
    thread_id,
    kind,
    handle,
    value,
    previous.event_id AS previous_event_id,
    previous.kind AS previous_kind,
    previous.handle = handle AS is_same_handle,
    previous.message = message AS is_same_message
FROM (
    SELECT
        event_id, ts_ns, trace_index, cpu_id, thread_id, kind, handle, message, value,
        lag(
            struct_pack(event_id := event_id, kind := kind, handle := handle, message := message)
        ) OVER on_thread AS previous
    FROM located
    WINDOW on_thread AS (PARTITION BY thread_id ORDER BY event_id)
)
