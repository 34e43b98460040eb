-- title: A thread that waits for a CPU
-- description: As a kernel trace or samples show: before its callback, or in it. What has the CPU
--     is named by program; a quota by its cgroup.
-- grain: one row per node and path
-- reads: application_path, blame, callback_cpu, callback_use, cpu_quota, cpu_user, noticed
-- next: query scheduling --measure programs
SELECT
    5 AS place,
    unnest(arg_max(w, w.mean_ns)),
    arg_max_null(u.function, w.mean_ns) AS function,
    sum(w.mean_ns)::BIGINT AS harm_ns,
    any_value(CASE WHEN q.node IS NULL AND p.reason IS NULL
        AND coalesce(p.used_cpus > l.of_callback, true) THEN p.program END) AS other,
    any_value(CASE WHEN q.node IS NULL THEN p.reason END) AS reason,
    any_value(CASE WHEN q.node IS NULL THEN p.used_cpus END) AS used_cpus,
    any_value(CASE WHEN q.node IS NULL THEN p.cpus ELSE q.cpus END) AS cpus,
    any_value(q.quota) AS quota,
    any_value(q.throttled_count) AS throttled_count,
    any_value(q.throttled_ns) AS throttled_ns,
    list(
        w.node || coalesce(w.callback, w.topic_name, '')
        || CASE WHEN w.share IS NULL THEN ' cpu' ELSE '' END
    ) AS claims
FROM (
    SELECT
        waiting_node AS node,
        waiting_callback AS callback,
        path, topic_name, mean_ns, p95_ns, lost, published
    FROM blame
    WHERE is_cpu
    UNION ALL BY NAME
    SELECT
        node, callback, path, topic_name,
        harm_ns * (waiting_ns / measured_ns) AS mean_ns,
        p95_ns, lost, published, run_ns, usual_ns, long_calls, count,
        waiting_ns / measured_ns AS share,
        running_ns, measured_ns, is_trend, since_ns, until_ns, before_ns, after_ns, occasion
    FROM long_callback
    WHERE waiting_ns > 0.5 * measured_ns
) AS w
JOIN application_path AS a ON w.path = a.path
LEFT JOIN callback_use AS u ON w.node = u.node AND w.callback = u.callback
CROSS JOIN noticed AS l
LEFT JOIN cpu_user AS p ON w.node = p.node
LEFT JOIN (
    SELECT
        node,
        sum(waiting_ns) AS waiting_ns
    FROM callback_cpu
    GROUP BY node
) AS c
    ON w.node = c.node
LEFT JOIN cpu_quota AS q
    ON w.node = q.node
    AND q.throttled_count >= l.lost
    AND q.throttled_ns >= l.of_callback * coalesce(c.waiting_ns, 0)
GROUP BY w.node, w.path
HAVING sum(w.mean_ns) >= any_value(l.least_ns)
    AND max(w.p95_ns) >= min(greatest(coalesce(u.limit_ns, l.late_ns), l.of_path * a.p95_ns))
