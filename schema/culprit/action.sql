-- title: The execution of a goal that blocks its executor
-- description: In Python a goal is executed in a callback of the executor: what else it has to run
--     waits until the goal is done.
-- grain: one row per action server
-- reads: accepted_goal, callback_use, harm
-- next: query callbacks --each --slowest 5 --node {node}
SELECT
    1 AS place, h.node, h.callback, h.function, h.path, h.topic_name, h.harm_ns, h.p95_ns, h.lost,
    h.published,
    coalesce(g.run_ns, u.run_ns) AS run_ns,
    coalesce(g.usual_ns, u.usual_ns) AS usual_ns,
    coalesce(g.ended, u.instances) AS count,
    h.waiting_node, h.waiting_callback,
    [h.node || h.callback, h.node || ' waits'] AS claims
FROM harm AS h
JOIN callback_use AS u ON h.node = u.node AND h.callback = u.callback
-- With what it awaits, where that is known.
LEFT JOIN accepted_goal AS g
    ON h.node = g.node AND h.callback = printf('Action(%s)', g.action_name)
WHERE h.matters AND starts_with(h.callback, 'Action(')
