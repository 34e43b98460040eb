-- title: A callback that waits for the disk
-- description: Its thread waits for a page or a disk most of the time that it takes.
-- grain: one row per node and callback
-- next: query callbacks --each --slowest 5 --node {node}
SELECT
    6 AS place,
    node, callback, function, path, topic_name, harm_ns, p95_ns, lost, published, run_ns, usual_ns,
    every, count, period_ns, load, waiting_node, waiting_callback,
    disk_ns / measured_ns AS share,
    claims || [node || ' waits', coalesce(waiting_node, node) || ' waits'] AS claims
FROM long_callback
WHERE disk_ns > 0.5 * measured_ns
