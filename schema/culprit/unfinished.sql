-- title: An action that does not end its goals
-- description: Its clients wait for the results.
-- grain: one row per action server
-- reads: application_path
-- next: query action-latency --node {node}
SELECT
    1 AS place,
    n.full_name AS node,
    r.length_ns // 2 AS harm_ns,
    f.detail AS reason,
    [n.full_name || ' goals'] AS claims
FROM main.finding AS f
JOIN main.node AS n ON f.node_id = n.node_id
CROSS JOIN (SELECT max(length_ns) AS length_ns FROM application_path) AS r
WHERE list_contains($runs, f.run_id) AND f.name = 'unfinished_goal'
