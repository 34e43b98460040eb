-- title: A thread that is asked for more than it has
-- description: The callbacks of an executor need more time than passes, and none of them alone
--     most of it.
-- grain: one row per executor
-- reads: callback_use, harm, noticed, thread_load
-- next: query executor-usage --node {node}
SELECT
    3 AS place,
    arg_max(h.node, l.demand) AS node,
    arg_max(h.callback, l.demand) AS callback,
    arg_max_null(h.function, l.demand) AS function,
    h.path,
    arg_max_null(h.topic_name, h.harm_ns) AS topic_name,
    sum(h.harm_ns)::BIGINT AS harm_ns,
    max(h.p95_ns) AS p95_ns,
    arg_max_null(h.lost, h.harm_ns) AS lost,
    arg_max_null(h.published, h.harm_ns) AS published,
    arg_max(u.usual_ns, l.demand) AS run_ns,
    -- How often it is due, not how often it runs.
    arg_max(u.usual_ns / l.demand, l.demand)::BIGINT AS period_ns,
    any_value(l.load) AS load,
    any_value(l.alike) AS count,
    arg_max_null(h.waiting_node, h.harm_ns) AS waiting_node,
    arg_max_null(h.waiting_callback, h.harm_ns) AS waiting_callback,
    flatten(
        list(list(h.node || h.callback) || list(h.node || ' waits')) OVER (
            PARTITION BY l.executor_id
        )
    ) AS claims
FROM harm AS h
JOIN thread_load AS l ON h.node = l.node AND h.callback = l.callback
JOIN callback_use AS u ON h.node = u.node AND h.callback = u.callback
CROSS JOIN noticed AS n
WHERE l.load >= n.load AND l.largest < 0.5 * l.load
GROUP BY l.executor_id, h.path
-- Each of them alone may be too little to notice.
HAVING bool_or(h.matters) OR sum(h.harm_ns) >= any_value(n.late_ns)
QUALIFY row_number() OVER (
    PARTITION BY l.executor_id ORDER BY sum(h.harm_ns) DESC, h.path
) = 1
