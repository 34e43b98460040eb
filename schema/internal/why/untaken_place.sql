-- title: Requests that a service or a node does not take
-- description: Where no flow ends, these may be what was asked for.
-- grain: one row per service
-- param: place VARCHAR  Name of a service or a node
-- column: sentence VARCHAR  What the finding says
SELECT DISTINCT f.subject || ': ' || f.detail AS sentence
FROM main.finding AS f
JOIN main.node AS n ON f.node_id = n.node_id
JOIN main.service AS s ON f.node_id = s.node_id
WHERE list_contains($runs, f.run_id)
    AND f.name = 'untaken_request'
    AND $place IN (n.full_name, s.service_name)
ORDER BY sentence
