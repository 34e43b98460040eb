-- title: A callback that waits for a lock
-- description: Its thread sleeps most of the time that it takes, and the thread that wakes it runs
--     another callback of its process, or has just run it.
-- grain: one row per node and callback
-- reads: callback_wake, harm
-- next: query callbacks --each --slowest 5 --node {node}
SELECT
    5 AS place,
    c.node, c.callback, c.function, c.path, c.topic_name,
    greatest(c.harm_ns, coalesce(h.harm_ns, 0)) AS harm_ns,
    c.p95_ns, c.lost, c.published,
    w.sleep_ns AS run_ns,
    w.other_node AS other,
    w.other_callback, w.other_function, w.is_supposed,
    c.claims || [w.other_node || w.other_callback, w.other_node || ' waits'] AS claims
FROM long_callback AS c
JOIN callback_wake AS w ON c.node = w.node AND c.callback = w.callback
LEFT JOIN harm AS h ON w.other_node = h.node AND w.other_callback = h.callback
WHERE c.sleeping_ns > 0.5 * c.measured_ns AND w.kind = 'thread' AND w.sleep_ns >= c.limit_ns
    AND c.node || c.callback <> w.other_node || w.other_callback
    AND w.is_same_process
