-- title: A callback that sleeps
-- description: Its thread sleeps most of the time that it takes.
-- grain: one row per node and callback
-- reads: callback_wake
-- next: query callbacks --each --slowest 5 --node {node}
SELECT
    6 AS place,
    node, callback, function, path, topic_name, harm_ns, p95_ns, lost, published, run_ns, usual_ns,
    every, count, period_ns, load, waiting_node, waiting_callback,
    sleeping_ns / measured_ns AS share,
    w.woken_by,
    claims || [node || ' waits', coalesce(waiting_node, node) || ' waits'] AS claims
FROM long_callback
LEFT JOIN (
    SELECT
        node AS slept_node,
        callback AS slept_callback,
        kind AS woken_by
    FROM callback_wake
) AS w
    ON node = w.slept_node AND callback = w.slept_callback
WHERE sleeping_ns > 0.5 * measured_ns
