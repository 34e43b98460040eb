-- title: A callback that takes long
-- description: It runs on the path, or others wait behind it. Whether it computes, sleeps, or has
--     no CPU is not known, or it does nothing of it most of the time.
-- grain: one row per node and callback
-- reads: harm
-- next: query callbacks --each --slowest 5 --node {node}
SELECT
    9 AS place,
    node, callback, function, path, topic_name, harm_ns, p95_ns, lost, published, run_ns, usual_ns,
    every, count, period_ns, load, waiting_node, waiting_callback,
    CASE WHEN measured_ns IS NULL THEN 'kernel' END AS lacks,
    claims || [node || ' waits', coalesce(waiting_node, node) || ' waits'] AS claims
FROM long_callback
UNION ALL BY NAME
-- Where no callbacks are traced: from a take to what the node publishes next.
SELECT
    9 AS place,
    node, path, topic_name, harm_ns, p95_ns,
    p95_ns AS run_ns,
    'callbacks' AS lacks,
    [node || topic_name] AS claims
FROM harm
WHERE matters AND callback IS NULL
