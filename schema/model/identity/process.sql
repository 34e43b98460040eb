-- description: Process lives. The name is that of the main thread (tid = pid), else of the first
--     thread seen; the version is what rcl_init stated, for display only. The tracer of Python
--     nodes says that of Python.
-- grain: one row per process life
-- when: staging.context
WITH process AS (
    SELECT
        process_id, host_id, pid_ns, vpid, life,
        coalesce(any_value(name) FILTER (WHERE vtid = vpid), arg_min(name, first_event_id)) AS name,
        min(first_seen_ns) AS first_seen_ns,
        max(last_seen_ns) AS last_seen_ns
    FROM staging.context
    GROUP BY ALL
),
version AS (
    SELECT process_id, arg_min(version, event_id) AS tracetools_version
    FROM staging.located('ros2_rcl_init')
    GROUP BY process_id
)
SELECT
    p.process_id, p.host_id, p.vpid AS pid, p.name, v.tracetools_version, y.python_version,
    p.first_seen_ns, p.last_seen_ns, p.pid_ns AS pid_namespace,
    p.life::INTEGER AS life,
    m.vpid IS NOT NULL AS is_ambiguous
FROM process AS p
LEFT JOIN version AS v ON p.process_id = v.process_id
LEFT JOIN (
    SELECT process_id, coalesce(any_value(text) FILTER (WHERE kind = 'python'), '?')
        AS python_version
    FROM staging.python_mark
    GROUP BY process_id
) AS y ON p.process_id = y.process_id
LEFT JOIN staging.mixed_process AS m
    ON p.host_id = m.host_id AND p.pid_ns IS NOT DISTINCT FROM m.pid_ns AND p.vpid = m.vpid
