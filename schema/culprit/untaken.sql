-- title: A service that takes no more requests
-- description: Its clients wait, or go on without an answer. A callback that does not end explains
--     it.
-- grain: one row per service
-- reads: application_path
-- next: query service-latency --node {node}
SELECT
    1 AS place,
    n.full_name AS node,
    r.length_ns // 2 AS harm_ns,
    f.detail AS reason,
    [n.full_name || ' requests'] AS claims
FROM main.finding AS f
JOIN main.node AS n ON f.node_id = n.node_id
CROSS JOIN (SELECT max(length_ns) AS length_ns FROM application_path) AS r
WHERE list_contains($runs, f.run_id) AND f.name = 'untaken_request'
