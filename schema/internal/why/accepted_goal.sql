-- title: How long action servers execute goals
-- description: As far as requests show it (Kilted and later).
-- grain: one row per node and action
-- when: main.service WHERE ends_with(service_name, '/_action/send_goal')
-- column: node VARCHAR  Node of the action server
-- column: action_name
-- column: usual_ns BIGINT [ns]  Median time from the answer to the result
-- column: run_ns BIGINT [ns]  95 % took no longer
-- column: ended BIGINT  So many results are known
SELECT
    n.full_name AS node,
    o.action_name,
    quantile_disc(o.execution_ns, 0.5) AS usual_ns,
    quantile_disc(o.execution_ns, 0.95) AS run_ns,
    count(*) AS ended
FROM main.goal AS o
JOIN main.service AS v ON o.action_server_id = v.service_id
JOIN main.node AS n ON v.node_id = n.node_id
WHERE list_contains($runs, o.run_id) AND o.execution_ns IS NOT NULL
GROUP BY n.full_name, o.action_name
