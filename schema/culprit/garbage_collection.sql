-- title: A callback in which Python collects garbage
-- description: The tracer of Python nodes tells how long each collection takes.
-- grain: one row per node and callback
-- reads: callback_garbage, noticed
-- next: query callbacks --each --slowest 5 --node {node}
SELECT
    7 AS place,
    c.*,
    g.garbage_ns / g.run_ns AS share
FROM long_callback AS c
JOIN callback_garbage AS g ON c.node = g.node AND c.callback = g.callback
CROSS JOIN noticed AS n
WHERE g.garbage_ns > n.of_callback * g.run_ns
