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
-- columns: first STRUCT(event_id BIGINT, ts_ns BIGINT, trace_index INTEGER, thread_index INTEGER),
--     last STRUCT(event_id BIGINT, ts_ns BIGINT, trace_index INTEGER, thread_index INTEGER),
--     previous_event_id BIGINT, callback_event_id BIGINT, writer UBIGINT, message UBIGINT,
--     dds_ns BIGINT, stamp BIGINT
CREATE OR REPLACE TEMP TABLE middleware_write AS
WITH write_begin AS (SELECT * FROM staging.call('dds_write_pre')),
write_end AS (SELECT * FROM staging.call('dds_write')),
pair AS (
    SELECT
        b.event_id AS begin_event_id,
        e.event_id AS end_event_id
    FROM write_begin AS b
    JOIN write_end AS e ON b.event_id = e.previous_event_id AND b.writer = e.writer
),
reversed_pair AS (
    SELECT
        b.event_id AS begin_event_id,
        e.event_id AS end_event_id
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
    CASE WHEN e.event_id < b.event_id THEN e.place ELSE coalesce(b.place, e.place) END AS first,
    CASE WHEN e.event_id < b.event_id THEN b.place ELSE coalesce(e.place, b.place) END AS last,
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
        coalesce(u.place, r.place) AS first,
        coalesce(r.place, u.place) AS last,
        coalesce(u.previous_callback_event_id, r.previous_callback_event_id) AS callback_event_id,
        coalesce(u.message, r.message) AS message,
        u.previous_event_id AS intra_event_id,
        u.ts_ns AS rclcpp_ns,
        r.ts_ns AS rcl_ns,
        u.publisher_handle AS rclcpp_handle,
        r.publisher_handle AS rcl_handle
    FROM staging.call('ros2_rclcpp_publish') AS u
    FULL JOIN staging.call('ros2_rcl_publish') AS r
        ON u.event_id = r.previous_event_id AND u.message = r.message
),
middleware AS (
    SELECT
        c.* REPLACE (
            coalesce(c.first, m.place) AS first,
            coalesce(m.place, c.last) AS last,
            coalesce(c.callback_event_id, m.previous_callback_event_id) AS callback_event_id,
            coalesce(c.message, m.message) AS message
        ),
        m.ts_ns AS rmw_ns,
        m.rmw_publisher_handle AS rmw_handle,
        nullif(m.timestamp, 0)::BIGINT AS stamp
    FROM client AS c
    FULL JOIN staging.call('ros2_rmw_publish') AS m
        ON c.last.event_id = m.previous_event_id AND c.message = m.message
),
written AS (
    SELECT
        m.* REPLACE (
            coalesce(m.first, w.first) AS first,
            coalesce(w.last, m.last) AS last,
            coalesce(m.callback_event_id, w.callback_event_id) AS callback_event_id,
            coalesce(m.message, w.message) AS message,
            greatest(m.stamp, w.stamp) AS stamp
        ),
        w.dds_ns, w.writer
    FROM middleware AS m
    FULL JOIN middleware_write AS w
        ON m.last.event_id = w.previous_event_id
        AND m.message = w.message
        AND coalesce(m.rmw_ns, m.rcl_ns) IS NOT NULL
),
caret AS (
    SELECT
        coalesce(w.place, s.place) AS first,
        coalesce(s.place, w.place) AS last,
        coalesce(w.previous_callback_event_id, s.previous_callback_event_id) AS callback_event_id,
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
        w.* REPLACE (
            coalesce(w.first, c.first) AS first,
            coalesce(c.last, w.last) AS last,
            coalesce(w.callback_event_id, c.callback_event_id) AS callback_event_id,
            greatest(w.stamp, c.stamp) AS stamp
        )
    FROM written AS w
    FULL JOIN caret AS c
        ON w.last.event_id = c.previous_event_id AND w.message = coalesce(c.message, w.message)
),
enqueued AS (
    SELECT
        previous_event_id,
        arg_max(place, event_id) AS place
    FROM staging.call('ros2_rclcpp_ring_buffer_enqueue')
    GROUP BY previous_event_id
),
intra AS (
    SELECT
        i.place AS first,
        coalesce(e.place, i.place) AS last,
        i.publisher_handle,
        i.previous_callback_event_id AS callback_event_id
    FROM staging.call('ros2_rclcpp_intra_publish') AS i
    LEFT JOIN enqueued AS e ON i.event_id = e.previous_event_id
),
complete AS (
    SELECT
        coalesce(i.first, x.first) AS first,
        coalesce(x.last, i.last) AS last,
        coalesce(i.first, x.first).event_id AS event_id,
        coalesce(i.first, x.first).thread_index AS thread_index,
        coalesce(i.callback_event_id, x.callback_event_id) AS callback_event_id,
        i.first.ts_ns AS intra_ns,
        x.rclcpp_ns, x.rcl_ns, x.rmw_ns, x.dds_ns,
        coalesce(x.rcl_handle, x.rclcpp_handle, i.publisher_handle) AS publisher_handle,
        x.rmw_handle, x.writer, x.stamp
    FROM inter AS x
    FULL JOIN intra AS i
        ON x.intra_event_id = i.first.event_id AND x.rcl_handle = i.publisher_handle
)
SELECT
    event_id AS start_event_id,
    last.event_id AS end_event_id,
    first.trace_index AS trace_index,
    thread_id, process_id,
    first.ts_ns AS start_ns,
    last.ts_ns AS end_ns,
    intra_ns, rclcpp_ns, rcl_ns, rmw_ns, dds_ns, publisher_handle, rmw_handle, writer,
    stamp AS source_timestamp_ns,
    callback_event_id
FROM staging.located('complete')
