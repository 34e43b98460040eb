-- name: staging.process
-- description: Process lives. The name is that of the main thread (tid = pid), else of the first
--     thread seen; the version is what rcl_init stated, for display only.
-- grain: one row per process life
-- when: staging.thread_life
WITH life AS (
    SELECT
        host_id,
        pid_ns,
        vpid,
        life,
        from_event_id,
        until_event_id,
        coalesce(
            any_value(name) FILTER (WHERE vtid = vpid),
            arg_min(name, first_event_id)
        ) AS name,
        min(first_event_id) AS first_event_id,
        min(first_seen_ns) AS first_seen_ns,
        max(last_seen_ns) AS last_seen_ns
    FROM staging.thread_life
    GROUP BY ALL
),
version AS (
    SELECT
        l.host_id,
        l.pid_ns,
        l.vpid,
        l.life,
        arg_min(i.version, i.event_id) AS tracetools_version
    FROM raw.ros2_rcl_init AS i
    JOIN staging.thread_life AS l
        ON i.thread_index = l.thread_index
        AND i.event_id >= l.from_event_id
        AND i.event_id < l.until_event_id
    GROUP BY ALL
)
SELECT
    row_number() OVER (ORDER BY l.first_event_id) AS process_id,
    l.host_id,
    l.vpid AS pid,
    l.name,
    v.tracetools_version,
    l.first_seen_ns,
    l.last_seen_ns,
    l.pid_ns AS pid_namespace,
    l.life::INTEGER AS life,
    m.vpid IS NOT NULL AS is_ambiguous
FROM life AS l
LEFT JOIN version AS v
    ON l.host_id = v.host_id
    AND l.pid_ns IS NOT DISTINCT FROM v.pid_ns
    AND l.vpid = v.vpid
    AND l.life = v.life
LEFT JOIN staging.mixed_process AS m
    ON l.host_id = m.host_id AND l.pid_ns IS NOT DISTINCT FROM m.pid_ns AND l.vpid = m.vpid
