-- title: The execution of a goal that blocks its executor
-- description: In Python a goal is executed in a callback of the executor: what else it has to run
--     waits until the goal is done.
-- grain: one row per action server
-- reads: callback_use, harm
-- next: query callbacks --each --slowest 5 --node {node}
SELECT
    1 AS place, h.node, h.callback, h.function, h.path, h.topic_name, h.harm_ns, h.p95_ns, h.lost,
    h.published,
    coalesce(g.goals[2], u.run_ns) AS run_ns,
    coalesce(g.goals[1], u.usual_ns) AS usual_ns,
    coalesce(g.count, u.instances) AS count,
    h.waiting_node, h.waiting_callback,
    [h.node || h.callback, h.node || ' waits'] AS claims
FROM harm AS h
JOIN callback_use AS u ON h.node = u.node AND h.callback = u.callback
-- With what it awaits, where that is known.
LEFT JOIN (
    SELECT
        n.full_name AS node,
        printf('Action(%s)', o.action_name) AS callback,
        quantile_disc(o.execution_ns, [0.5, 0.95]) AS goals,
        count(*) AS count
    FROM main.goal AS o
    JOIN main.service AS v ON o.action_server_id = v.service_id
    JOIN main.node AS n ON v.node_id = n.node_id
    WHERE list_contains($runs, o.run_id) AND o.execution_ns IS NOT NULL
    GROUP BY n.full_name, o.action_name
) AS g ON h.node = g.node AND h.callback = g.callback
WHERE h.matters AND starts_with(h.callback, 'Action(')
