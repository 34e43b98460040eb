-- description: Nodes. A handle that objects name but that was never initialised in the trace gets
--     a row without a name. Nodes of several processes may have one name at a time (two robots, two
--     domains): behind it stands the host then, or the process, or both.
-- grain: one row per ROS node
-- when: raw.ros2_rcl_node_init, staging.object_node
WITH every_node AS (
    SELECT
        event_id, process_id,
        node_name AS name,
        namespace,
        namespace || CASE WHEN namespace LIKE '%/' THEN '' ELSE '/' END || node_name AS full_name,
        node_handle,
        ts_ns AS created_ns,
        false AS is_inferred
    FROM staging.located('raw.ros2_rcl_node_init')
    UNION ALL BY NAME
    SELECT DISTINCT
        node_event_id AS event_id,
        process_id, node_handle,
        true AS is_inferred
    FROM staging.object_node
    WHERE is_inferred
),
lived AS (
    SELECT
        process_id, host_id, vpid,
        min(first_seen_ns) AS first_ns,
        max(last_seen_ns) AS last_ns
    FROM staging.thread
    GROUP BY process_id, host_id, vpid
),
-- With the processes of all nodes of its name.
named AS (
    SELECT
        n.event_id, n.process_id, n.name, n.namespace, n.full_name, n.node_handle, n.created_ns,
        n.is_inferred, h.hostname, l.vpid, l.first_ns, l.last_ns,
        list(struct_pack(l.process_id, h.hostname, l.vpid, l.first_ns, l.last_ns)) OVER (
            PARTITION BY n.full_name, CASE WHEN n.full_name IS NULL THEN n.event_id END
        ) AS twins
    FROM every_node AS n
    JOIN lived AS l ON n.process_id = l.process_id
    JOIN staging.host AS h ON l.host_id = h.host_id
),
placed AS (
    SELECT
        *,
        list_transform(
            list_filter(
                twins,
                lambda each: each.process_id <> named.process_id
                    AND each.first_ns < named.last_ns
                    AND named.first_ns < each.last_ns
            ),
            lambda each: [each.hostname, each.vpid::VARCHAR]
        ) AS besides
    FROM named
)
SELECT
    row_number() OVER (ORDER BY event_id) AS node_id,
    process_id, name, namespace,
    full_name || coalesce(
        '@' || nullif(
            concat_ws(
                ' ',
                CASE WHEN len(list_filter(besides, lambda each: each[1] <> hostname)) > 0
                    THEN hostname END,
                CASE WHEN len(list_filter(besides, lambda each: each[1] = hostname)) > 0
                    THEN vpid END,
                -- Containers may share both.
                CASE WHEN list_contains(besides, [hostname, vpid::VARCHAR])
                    THEN '#' || process_id END
            ),
            ''
        ),
        ''
    ) AS full_name,
    node_handle, created_ns, is_inferred, event_id
FROM placed
