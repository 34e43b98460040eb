-- description: Layers of publish() calls stitched together. A layer continues the call only if it
--     directly follows on the thread, comes from an earlier layer, and was given the same message.
--     An intra-process publication and the inter-process one that directly follows it for the same
--     publisher are one call. Messages enqueued without such a publication before them are the
--     replay of a transient-local buffer, not a call.
-- grain: one row per publish() call
-- when: raw.ros2_rclcpp_publish, raw.ros2_rcl_publish, raw.ros2_rmw_publish,
--     raw.dds_write, raw.dds_write_pre, raw.ros2_caret_dds_write,
--     raw.ros2_caret_dds_bind_addr_to_stamp, raw.ros2_rclcpp_intra_publish

-- What instrumented middleware says of one write: begin and end, in either order, or only one.
-- when: raw.dds_write, raw.dds_write_pre
-- columns: start_event_id BIGINT, end_event_id BIGINT, start_ns BIGINT, end_ns BIGINT,
--     trace_index INTEGER, thread_index INTEGER, previous_event_id BIGINT,
--     callback_event_id BIGINT, writer UBIGINT, message UBIGINT, dds_ns BIGINT, stamp BIGINT
CREATE OR REPLACE TEMP TABLE middleware_write AS
WITH write_begin AS (SELECT * FROM staging.call('dds_write_pre')),
write_end AS (SELECT * FROM staging.call('dds_write')),
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
    least(b.event_id, e.event_id) AS start_event_id,
    greatest(b.event_id, e.event_id) AS end_event_id,
    least(b.ts_ns, e.ts_ns) AS start_ns,
    greatest(b.ts_ns, e.ts_ns) AS end_ns,
    coalesce(b.trace_index, e.trace_index) AS trace_index,
    coalesce(b.thread_index, e.thread_index) AS thread_index,
    CASE
        WHEN e.event_id < b.event_id THEN e.previous_event_id
        ELSE coalesce(b.previous_event_id, e.previous_event_id)
    END AS previous_event_id,
    coalesce(b.previous_callback_event_id, e.previous_callback_event_id) AS callback_event_id,
    coalesce(b.writer, e.writer) AS writer,
    coalesce(b.data, e.data) AS message,
    e.ts_ns AS dds_ns,
    nullif(e.timestamp, 0)::BIGINT AS stamp
FROM write_begin AS b
LEFT JOIN every_pair AS p ON b.event_id = p.begin_event_id
FULL JOIN write_end AS e ON p.end_event_id = e.event_id;

WITH client AS (
    SELECT
        coalesce(u.event_id, r.event_id) AS start_event_id,
        coalesce(r.event_id, u.event_id) AS end_event_id,
        coalesce(u.ts_ns, r.ts_ns) AS start_ns,
        coalesce(r.ts_ns, u.ts_ns) AS end_ns,
        coalesce(u.trace_index, r.trace_index) AS trace_index,
        coalesce(u.thread_index, r.thread_index) AS thread_index,
        coalesce(u.previous_callback_event_id, r.previous_callback_event_id)
            AS callback_event_id,
        coalesce(u.message, r.message) AS message,
        u.previous_event_id AS intra_event_id, u.ts_ns AS rclcpp_ns, r.ts_ns AS rcl_ns,
        u.publisher_handle AS rclcpp_handle, r.publisher_handle AS rcl_handle
    FROM staging.call('ros2_rclcpp_publish') AS u
    FULL JOIN staging.call('ros2_rcl_publish') AS r
        ON u.event_id = r.previous_event_id AND u.message = r.message
),
middleware AS (
    SELECT
        coalesce(c.start_event_id, m.event_id) AS start_event_id,
        coalesce(m.event_id, c.end_event_id) AS end_event_id,
        coalesce(c.start_ns, m.ts_ns) AS start_ns,
        coalesce(m.ts_ns, c.end_ns) AS end_ns,
        coalesce(c.trace_index, m.trace_index) AS trace_index,
        coalesce(c.thread_index, m.thread_index) AS thread_index,
        coalesce(c.callback_event_id, m.previous_callback_event_id) AS callback_event_id,
        coalesce(c.message, m.message) AS message,
        c.intra_event_id, c.rclcpp_ns, c.rcl_ns, m.ts_ns AS rmw_ns, c.rclcpp_handle, c.rcl_handle,
        m.rmw_publisher_handle AS rmw_handle,
        nullif(m.timestamp, 0)::BIGINT AS stamp
    FROM client AS c
    FULL JOIN staging.call('ros2_rmw_publish') AS m
        ON c.end_event_id = m.previous_event_id AND c.message = m.message
),
written AS (
    SELECT
        coalesce(m.start_event_id, w.start_event_id) AS start_event_id,
        coalesce(w.end_event_id, m.end_event_id) AS end_event_id,
        coalesce(m.start_ns, w.start_ns) AS start_ns,
        coalesce(w.end_ns, m.end_ns) AS end_ns,
        coalesce(m.trace_index, w.trace_index) AS trace_index,
        coalesce(m.thread_index, w.thread_index) AS thread_index,
        coalesce(m.callback_event_id, w.callback_event_id) AS callback_event_id,
        coalesce(m.message, w.message) AS message,
        m.intra_event_id, m.rclcpp_ns, m.rcl_ns, m.rmw_ns, w.dds_ns,
        m.rclcpp_handle, m.rcl_handle, m.rmw_handle, w.writer,
        greatest(m.stamp, w.stamp) AS stamp
    FROM middleware AS m
    FULL JOIN middleware_write AS w
        ON m.end_event_id = w.previous_event_id
        AND m.message = w.message
        AND coalesce(m.rmw_ns, m.rcl_ns) IS NOT NULL
),
caret AS (
    SELECT
        coalesce(w.event_id, s.event_id) AS start_event_id,
        coalesce(s.event_id, w.event_id) AS end_event_id,
        coalesce(w.ts_ns, s.ts_ns) AS start_ns,
        coalesce(s.ts_ns, w.ts_ns) AS end_ns,
        coalesce(w.trace_index, s.trace_index) AS trace_index,
        coalesce(w.thread_index, s.thread_index) AS thread_index,
        coalesce(w.previous_callback_event_id, s.previous_callback_event_id)
            AS callback_event_id,
        w.message,
        CASE WHEN w.event_id IS NULL THEN s.previous_event_id ELSE w.previous_event_id END
            AS previous_event_id,
        nullif(s.source_stamp, 0)::BIGINT AS stamp
    FROM staging.call('ros2_caret_dds_write') AS w
    FULL JOIN staging.call('ros2_caret_dds_bind_addr_to_stamp') AS s
        ON w.event_id = s.previous_event_id
),
inter AS (
    SELECT
        coalesce(w.start_event_id, c.start_event_id) AS start_event_id,
        coalesce(c.end_event_id, w.end_event_id) AS end_event_id,
        coalesce(w.start_ns, c.start_ns) AS start_ns,
        coalesce(c.end_ns, w.end_ns) AS end_ns,
        coalesce(w.trace_index, c.trace_index) AS trace_index,
        coalesce(w.thread_index, c.thread_index) AS thread_index,
        coalesce(w.callback_event_id, c.callback_event_id) AS callback_event_id,
        w.intra_event_id, w.rclcpp_ns, w.rcl_ns, w.rmw_ns, w.dds_ns,
        w.rclcpp_handle, w.rcl_handle, w.rmw_handle, w.writer,
        greatest(w.stamp, c.stamp) AS stamp
    FROM written AS w
    FULL JOIN caret AS c
        ON w.end_event_id = c.previous_event_id AND w.message = coalesce(c.message, w.message)
),
enqueued AS (
    SELECT previous_event_id, max(event_id) AS event_id, max(ts_ns) AS ts_ns
    FROM staging.call('ros2_rclcpp_ring_buffer_enqueue')
    GROUP BY previous_event_id
),
intra AS (
    SELECT
        i.event_id AS start_event_id,
        coalesce(e.event_id, i.event_id) AS end_event_id,
        i.ts_ns AS start_ns,
        coalesce(e.ts_ns, i.ts_ns) AS end_ns,
        i.trace_index, i.thread_index, i.publisher_handle,
        i.previous_callback_event_id AS callback_event_id
    FROM staging.call('ros2_rclcpp_intra_publish') AS i
    LEFT JOIN enqueued AS e ON i.event_id = e.previous_event_id
),
complete AS (
    SELECT
        coalesce(i.start_event_id, x.start_event_id) AS start_event_id,
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
    w.start_event_id, w.end_event_id, w.trace_index, c.thread_id, c.process_id, w.start_ns,
    w.end_ns, w.intra_ns, w.rclcpp_ns, w.rcl_ns, w.rmw_ns, w.dds_ns, w.publisher_handle,
    w.rmw_handle, w.writer, w.stamp AS source_timestamp_ns, w.callback_event_id
FROM complete AS w
JOIN staging.thread AS c
    ON w.thread_index = c.thread_index
    AND w.start_event_id >= c.from_event_id
    AND w.start_event_id < c.until_event_id
