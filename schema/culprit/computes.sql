-- title: A callback that computes
-- description: Its thread is on a CPU most of the time that it takes.
-- grain: one row per node and callback
-- next: query callbacks --each --slowest 5 --node {node}
SELECT
    8 AS place,
    node, callback, function, path, topic_name, harm_ns, p95_ns, lost, published, run_ns, usual_ns,
    every, count, period_ns, load, waiting_node, waiting_callback,
    claims || [node || ' waits', coalesce(waiting_node, node) || ' waits'] AS claims
FROM long_callback
WHERE running_ns > 0.5 * measured_ns
