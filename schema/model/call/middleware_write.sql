-- description: What instrumented middleware says of one write: begin and end, in either order, or
--     only one of them.
-- grain: one row per write
-- when: raw.dds_write, raw.dds_write_pre
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
FULL JOIN write_end AS e ON p.end_event_id = e.event_id
