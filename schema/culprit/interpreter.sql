-- title: A callback that waits for Python, since another thread computes
-- description: Threads of Python compute one after the other: the callback computes at times only,
--     and threads of its process that run no callbacks are busy, more than any other program.
-- grain: one row per node and callback
-- reads: cpu_user, noticed, process_load
-- next: query callbacks --each --slowest 5 --node {node}
SELECT
    4 AS place,
    c.*,
    1 - (c.running_ns + c.disk_ns) / c.measured_ns AS share
FROM long_callback AS c
JOIN process_load AS l ON c.node = l.node
LEFT JOIN cpu_user AS u ON c.node = u.node
CROSS JOIN noticed AS n
WHERE l.is_python
    AND c.running_ns > n.of_path * c.measured_ns
    AND c.measured_ns - c.running_ns - c.disk_ns > n.of_callback * c.measured_ns
    AND l.cpus - l.own_cpus > greatest(n.of_callback, coalesce(u.used_cpus, 0))
