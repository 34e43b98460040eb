-- name: staging.publication_chain
-- description: Layers of publish() calls stitched together. A layer continues the call only if it
--     directly follows on the thread, comes from an earlier layer, and was given the same message
--     (dds: the same writer, write_pre and write in either order). A group that starts with an
--     enqueue is the replay of a transient-local buffer, not a publication.
-- grain: one row per chain of layers, intra-process and inter-process apart
-- needs: staging.thread_event, staging.thread_gap
WITH write_first AS (
    SELECT d.event_id
    FROM staging.thread_event AS d
    JOIN staging.thread_event AS p ON d.event_id = p.previous_event_id
    WHERE d.kind = 'dds' AND d.is_same_message IS NULL AND d.previous_kind = 'rmw'
        AND p.kind = 'dds_data' AND p.is_same_handle
),
layer AS (
    SELECT
        e.event_id, e.ts_ns, e.trace_index, e.thread_id, e.kind, e.handle, e.value,
        e.previous_event_id,
        coalesce(
            e.previous_kind IN ('intra', 'enqueue') AND e.kind = 'rclcpp' AND g.event_id IS NULL,
            false
        ) AS follows_intra,
        coalesce(CASE
            WHEN g.event_id IS NOT NULL THEN false
            WHEN e.kind = 'enqueue' THEN e.previous_kind IN ('intra', 'enqueue')
            WHEN e.kind = 'rcl' THEN e.previous_kind = 'rclcpp' AND e.is_same_message
            WHEN e.kind = 'rmw' THEN
                e.previous_kind IN ('rclcpp', 'rcl') AND e.is_same_message
            WHEN e.kind = 'dds_data' THEN
                (e.previous_kind = 'rmw' AND e.is_same_message)
                OR (e.previous_kind = 'dds' AND e.is_same_handle)
            WHEN e.kind = 'dds' THEN
                (e.previous_kind = 'dds_data' AND e.is_same_handle)
                OR (
                    e.previous_kind = 'rmw'
                    AND (e.is_same_message OR w.event_id IS NOT NULL)
                )
            WHEN e.kind = 'caret_write' THEN
                e.previous_kind IN ('rclcpp', 'rcl', 'rmw') AND e.is_same_message
            WHEN e.kind IN ('caret_copy', 'caret_stamp') THEN
                e.previous_kind IN ('rcl', 'rmw', 'caret_write', 'caret_copy')
            ELSE false
        END, false) AS continues
    FROM staging.thread_event AS e
    LEFT JOIN staging.thread_gap AS g ON e.event_id = g.event_id
    LEFT JOIN write_first AS w ON e.event_id = w.event_id
    WHERE e.kind IN (
        'intra', 'enqueue', 'rclcpp', 'rcl', 'rmw', 'dds_data', 'dds',
        'caret_write', 'caret_copy', 'caret_stamp'
    )
),
chained AS (
    SELECT
        event_id, ts_ns, trace_index, thread_id, kind, handle, value, previous_event_id,
        follows_intra,
        max(CASE WHEN NOT continues THEN event_id END) OVER (
            PARTITION BY thread_id ORDER BY event_id ROWS UNBOUNDED PRECEDING
        ) AS chain_id
    FROM layer
)
SELECT
    chain_id AS start_event_id,
    max(event_id) AS end_event_id,
    any_value(trace_index) AS trace_index,
    any_value(thread_id) AS thread_id,
    min(ts_ns) AS start_ns,
    max(ts_ns) AS end_ns,
    max(CASE WHEN kind = 'intra' THEN ts_ns END) AS intra_ns,
    max(CASE WHEN kind = 'rclcpp' THEN ts_ns END) AS rclcpp_ns,
    max(CASE WHEN kind = 'rcl' THEN ts_ns END) AS rcl_ns,
    max(CASE WHEN kind = 'rmw' THEN ts_ns END) AS rmw_ns,
    max(CASE WHEN kind = 'dds' THEN ts_ns END) AS dds_ns,
    max(CASE WHEN kind = 'intra' THEN handle END) AS intra_handle,
    max(CASE WHEN kind = 'rclcpp' THEN handle END) AS rclcpp_handle,
    max(CASE WHEN kind = 'rcl' THEN handle END) AS rcl_handle,
    max(CASE WHEN kind = 'rmw' THEN handle END) AS rmw_handle,
    max(CASE WHEN kind IN ('dds_data', 'dds') THEN handle END) AS writer,
    max(CASE WHEN kind IN ('rmw', 'dds', 'caret_stamp') AND value <> 0 THEN value END)
        AS source_timestamp_ns,
    max(CASE WHEN follows_intra AND event_id = chain_id THEN previous_event_id END)
        AS intra_end_event_id
FROM chained
GROUP BY chain_id
HAVING bool_or(kind <> 'enqueue')
