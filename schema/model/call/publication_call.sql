-- description: Layers of publish() calls stitched together, as `staging.call` says. An
--     intra-process publication and the inter-process one that directly follows it for the same
--     publisher are one call. Messages enqueued without such a publication before them are the
--     replay of a transient-local buffer, not a call.
-- grain: one row per publish() call
-- when: raw.ros2_rclcpp_publish, raw.ros2_rcl_publish, raw.ros2_rmw_publish,
--     raw.dds_write, raw.dds_write_pre, raw.ros2_caret_dds_write,
--     raw.ros2_caret_dds_bind_addr_to_stamp, raw.ros2_rclcpp_intra_publish

-- What instrumented middleware says of one write: begin and end, in either order, or only one.
-- when: raw.dds_write, raw.dds_write_pre
-- columns: event_id BIGINT, last_event_id BIGINT, ts_ns BIGINT, last_ns BIGINT,
--     trace_index INTEGER, thread_index INTEGER, previous_call_event_id BIGINT,
--     previous_callback_event_id BIGINT, writer UBIGINT, message UBIGINT, dds_ns BIGINT,
--     stamp BIGINT
CREATE OR REPLACE TEMP TABLE middleware_write AS
WITH gap AS (SELECT event_id FROM staging.near_gap WHERE sequence = 'call' AND is_behind),
write_begin AS (
    SELECT
        *,
        CASE WHEN event_id NOT IN (FROM gap) THEN previous_call_event_id END AS previous_event_id
    FROM raw.dds_write_pre
),
write_end AS (
    SELECT
        *,
        CASE WHEN event_id NOT IN (FROM gap) THEN previous_call_event_id END AS previous_event_id
    FROM raw.dds_write
),
pair AS (
    SELECT b.event_id AS begin_event_id, e.event_id AS end_event_id
    FROM write_begin AS b
    JOIN write_end AS e ON b.event_id = e.previous_event_id AND b.writer = e.writer
),
reversed_pair AS (
    SELECT b.event_id AS begin_event_id, e.event_id AS end_event_id
    FROM write_end AS e
    JOIN write_begin AS b ON e.event_id = b.previous_event_id AND e.writer = b.writer
    WHERE e.event_id NOT IN (SELECT end_event_id FROM pair)
        AND b.event_id NOT IN (SELECT begin_event_id FROM pair)
),
every_pair AS (
    SELECT begin_event_id, end_event_id FROM pair
    UNION ALL
    SELECT begin_event_id, end_event_id FROM reversed_pair
)
SELECT
    least(b.event_id, e.event_id) AS event_id,
    greatest(b.event_id, e.event_id) AS last_event_id,
    least(b.ts_ns, e.ts_ns) AS ts_ns,
    greatest(b.ts_ns, e.ts_ns) AS last_ns,
    coalesce(b.trace_index, e.trace_index) AS trace_index,
    coalesce(b.thread_index, e.thread_index) AS thread_index,
    CASE
        WHEN e.event_id < b.event_id THEN e.previous_event_id
        ELSE coalesce(b.previous_event_id, e.previous_event_id)
    END AS previous_call_event_id,
    coalesce(b.previous_callback_event_id, e.previous_callback_event_id)
        AS previous_callback_event_id,
    coalesce(b.writer, e.writer) AS writer,
    coalesce(b.data, e.data) AS message,
    e.ts_ns AS dds_ns,
    nullif(e.timestamp, 0)::BIGINT AS stamp
FROM write_begin AS b
LEFT JOIN every_pair AS p ON b.event_id = p.begin_event_id
FULL JOIN write_end AS e ON p.end_event_id = e.event_id;

WITH layer AS (
    SELECT *, 'rclcpp' AS layer, []::VARCHAR[] AS follows FROM raw.ros2_rclcpp_publish
    UNION ALL BY NAME
    SELECT *, 'rcl' AS layer, ['rclcpp'] AS follows FROM raw.ros2_rcl_publish
    UNION ALL BY NAME
    SELECT *, timestamp AS stamp, 'rmw' AS layer, ['rclcpp', 'rcl'] AS follows
    FROM raw.ros2_rmw_publish
    UNION ALL BY NAME
    SELECT *, 'dds' AS layer, ['rcl', 'rmw'] AS follows FROM middleware_write
    UNION ALL BY NAME
    SELECT *, 'caret' AS layer, ['rclcpp', 'rcl', 'rmw', 'dds'] AS follows
    FROM raw.ros2_caret_dds_write
    UNION ALL BY NAME
    SELECT
        *,
        source_stamp AS stamp,
        'stamp' AS layer,
        ['rclcpp', 'rcl', 'rmw', 'dds', 'caret'] AS follows
    FROM raw.ros2_caret_dds_bind_addr_to_stamp
),
inter AS (
    SELECT
        thread_index,
        min(event_id) AS start_event_id,
        max(coalesce(last_event_id, event_id)) AS end_event_id,
        min(ts_ns) AS start_ns,
        max(coalesce(last_ns, ts_ns)) AS end_ns,
        arg_min(trace_index, event_id) AS trace_index,
        arg_min(previous_callback_event_id, event_id) AS callback_event_id,
        any_value(previous_event_id) FILTER (layer = 'rclcpp') AS intra_event_id,
        any_value(ts_ns) FILTER (layer = 'rclcpp') AS rclcpp_ns,
        any_value(ts_ns) FILTER (layer = 'rcl') AS rcl_ns,
        any_value(ts_ns) FILTER (layer = 'rmw') AS rmw_ns,
        any_value(dds_ns) AS dds_ns,
        any_value(publisher_handle) FILTER (layer = 'rclcpp') AS rclcpp_handle,
        any_value(publisher_handle) FILTER (layer = 'rcl') AS rcl_handle,
        any_value(rmw_publisher_handle) AS rmw_handle,
        any_value(writer) AS writer,
        nullif(max(stamp), 0)::BIGINT AS stamp
    FROM staging.call('layer')
    GROUP BY thread_index, call_number
),
enqueued AS (
    SELECT previous_call_event_id, max(event_id) AS event_id, max(ts_ns) AS ts_ns
    FROM raw.ros2_rclcpp_ring_buffer_enqueue
    WHERE event_id NOT IN (
        SELECT event_id FROM staging.near_gap WHERE sequence = 'call' AND is_behind
    )
    GROUP BY previous_call_event_id
),
intra AS (
    SELECT
        i.event_id AS start_event_id,
        coalesce(e.event_id, i.event_id) AS end_event_id,
        i.ts_ns AS start_ns,
        coalesce(e.ts_ns, i.ts_ns) AS end_ns,
        i.trace_index, i.thread_index, i.publisher_handle,
        i.previous_callback_event_id AS callback_event_id
    FROM raw.ros2_rclcpp_intra_publish AS i
    LEFT JOIN enqueued AS e ON i.event_id = e.previous_call_event_id
),
complete AS (
    SELECT
        coalesce(i.start_event_id, x.start_event_id) AS event_id,
        coalesce(x.end_event_id, i.end_event_id) AS end_event_id,
        coalesce(i.start_ns, x.start_ns) AS start_ns,
        coalesce(x.end_ns, i.end_ns) AS end_ns,
        coalesce(i.trace_index, x.trace_index) AS trace_index,
        coalesce(i.thread_index, x.thread_index) AS thread_index,
        coalesce(i.callback_event_id, x.callback_event_id) AS callback_event_id,
        i.start_ns AS intra_ns, x.rclcpp_ns, x.rcl_ns, x.rmw_ns, x.dds_ns,
        coalesce(x.rcl_handle, x.rclcpp_handle, i.publisher_handle) AS publisher_handle,
        x.rmw_handle, x.writer, x.stamp
    FROM inter AS x
    FULL JOIN intra AS i
        ON x.intra_event_id = i.start_event_id AND x.rcl_handle = i.publisher_handle
)
SELECT
    event_id AS start_event_id, end_event_id, trace_index, thread_id, process_id, start_ns, end_ns,
    intra_ns, rclcpp_ns, rcl_ns, rmw_ns, dds_ns, publisher_handle, rmw_handle, writer,
    stamp AS source_timestamp_ns, callback_event_id
FROM staging.located('complete')
