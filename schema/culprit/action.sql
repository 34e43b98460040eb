-- title: The execution of a goal that blocks its executor
-- description: In Python a goal is executed in a callback of the executor: what else it has to run
--     waits until the goal is done.
-- grain: one row per action server
-- reads: callback_use, harm
-- next: query callbacks --each --slowest 5 --node {node}
SELECT
    1 AS place, h.node, h.callback, h.function, h.path, h.topic_name, h.harm_ns, h.p95_ns, h.lost,
    h.published, u.run_ns, u.usual_ns,
    u.instances AS count,
    h.waiting_node, h.waiting_callback,
    [h.node || h.callback, h.node || ' waits'] AS claims
FROM harm AS h
JOIN callback_use AS u ON h.node = u.node AND h.callback = u.callback
WHERE h.matters AND starts_with(h.callback, 'Action(')
