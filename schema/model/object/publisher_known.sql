-- description: Publishers whose rcl initialisation was traced, with their rmw handle, their GID
--     (first 16 bytes; all zeros: none) and, where DDS is instrumented, their writer: by GID, or
--     where one of the two has none, by topic. Each writer belongs to one
--     publisher, but none to one of Agnocast.
-- grain: one row per rcl_publisher_init
-- when: raw.ros2_rcl_publisher_init
WITH rmw_init AS (
    SELECT
        event_id, ts_ns, process_id, rmw_publisher_handle,
        staging.gid_bytes(gid) AS gid
    FROM staging.located('raw.ros2_rmw_publisher_init')
),
writer_init AS (
    SELECT
        event_id, ts_ns, process_id, writer, topic_name,
        staging.gid_bytes(coalesce(gid, gid_prefix || gid_entity)) AS gid
    FROM staging.located('raw.dds_create_writer')
),
with_rmw AS (
    SELECT
        p.event_id, p.ts_ns, p.process_id, p.publisher_handle, p.topic_name, p.queue_depth,
        nullif(p.rmw_publisher_handle, 0) AS rmw_handle,
        coalesce(p.rmw_publisher_handle = 0, false) AS is_agnocast,
        CASE WHEN p.rmw_publisher_handle IS DISTINCT FROM 0 THEN 'rt' || p.topic_name END
            AS dds_topic,
        r.gid,
        r.ts_ns AS rmw_created_ns
    FROM staging.located('raw.ros2_rcl_publisher_init') AS p
    ASOF LEFT JOIN rmw_init AS r
        ON p.process_id = r.process_id
        AND p.rmw_publisher_handle = r.rmw_publisher_handle
        AND p.event_id >= r.event_id
),
with_writer AS (
    SELECT
        p.event_id, p.ts_ns, p.process_id, p.publisher_handle, p.topic_name, p.queue_depth,
        p.rmw_handle, p.gid, p.rmw_created_ns, p.is_agnocast,
        coalesce(g.writer, t.writer, o.writer) AS writer,
        coalesce(g.ts_ns, t.ts_ns, o.ts_ns) AS writer_created_ns
    FROM with_rmw AS p
    ASOF LEFT JOIN writer_init AS g
        ON p.process_id = g.process_id AND p.gid = g.gid AND p.event_id >= g.event_id
    ASOF LEFT JOIN (SELECT * FROM writer_init WHERE gid IS NULL) AS t
        ON p.process_id = t.process_id AND p.dds_topic = t.topic_name AND p.event_id >= t.event_id
    LEFT JOIN (
        SELECT p.event_id, w.writer, w.ts_ns
        FROM (SELECT * FROM with_rmw WHERE gid IS NULL) AS p
        ASOF JOIN writer_init AS w
            ON p.process_id = w.process_id
            AND p.dds_topic = w.topic_name
            AND p.event_id >= w.event_id
        QUALIFY row_number() OVER (PARTITION BY w.event_id ORDER BY p.event_id) = 1
    ) AS o
        ON p.event_id = o.event_id
)
SELECT
    p.event_id, p.process_id, p.topic_name, p.publisher_handle, p.rmw_handle, p.writer, p.gid,
    p.queue_depth,
    least(p.ts_ns, p.rmw_created_ns, p.writer_created_ns) AS created_ns,
    staging.is_internal_topic(p.topic_name) AS is_internal,
    p.is_agnocast
FROM with_writer AS p
