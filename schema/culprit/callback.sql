-- title: A callback that takes long
-- description: It runs on the path, or others wait behind it. Whether it computes, sleeps, or has
--     no CPU is not known, or it does nothing of it most of the time.
-- grain: one row per node and callback
-- reads: harm
-- next: query callbacks --each --slowest 5 --node {node}
SELECT
    9 AS place,
    *,
    CASE
        WHEN measured_ns IS NULL THEN 'cpu'
        WHEN waiting_ns IS NULL THEN 'samples'
    END AS lacks
FROM long_callback
UNION ALL BY NAME
-- Where no callbacks are traced: from a take to what the node publishes next.
SELECT
    9 AS place,
    node, path, topic_name, harm_ns, p95_ns,
    p95_ns AS run_ns,
    CASE WHEN NOT EXISTS (
        FROM main.node AS n
        JOIN main.process AS p ON n.process_id = p.process_id
        WHERE n.full_name = harm.node
            AND p.python_version IS NOT NULL
            AND list_contains($runs, n.run_id)
    ) THEN 'callbacks' END AS lacks,
    [node || topic_name] AS claims
FROM harm
WHERE matters AND callback IS NULL
