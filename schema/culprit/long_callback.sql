-- description: Callbacks that run long on a path, or behind which others wait. How long: as those
--     that took much longer than usual, unless what is usual is too long.
-- grain: one row per node and callback
-- reads: callback_change, callback_cpu, callback_use, harm, held_message, noticed, thread_load
-- kind: inline
WITH judged AS (
    SELECT
        h.*, u.usual_ns, u.run_ns, u.long_ns, u.long_instances, u.instances, u.period_ns, l.load,
        CASE WHEN l.per_take > 1 + n.of_messages THEN l.per_take END AS per_take,
        -- What matters to the callback itself, or to the one that waits for it longest.
        least(u.limit_ns, w.limit_ns) AS limit_ns
    FROM harm AS h
    JOIN callback_use AS u ON h.node = u.node AND h.callback = u.callback
    LEFT JOIN callback_use AS w
        ON h.waiting_node = w.node AND h.waiting_callback = w.callback
    LEFT JOIN thread_load AS l ON h.node = l.node AND h.callback = l.callback
    CROSS JOIN noticed AS n
    WHERE h.matters
),
named AS (
    SELECT
        *,
        coalesce(long_ns, CASE WHEN usual_ns >= limit_ns THEN usual_ns ELSE run_ns END) AS takes_ns
    FROM judged
)
SELECT
    h.node, h.callback, h.function, h.path, h.topic_name, h.harm_ns, h.p95_ns, h.lost, h.published,
    h.takes_ns AS run_ns,
    h.usual_ns,
    h.long_instances AS long_calls,
    h.instances AS count,
    h.period_ns, h.load, h.per_take, h.waiting_node, h.waiting_callback, h.limit_ns,
    [h.node || h.callback, h.node || ' waits', coalesce(h.waiting_node, h.node) || ' waits']
    AS claims,
    c.run_ns AS measured_ns,
    c.running_ns, c.waiting_ns, c.sleeping_ns, c.disk_ns,
    m.node IS NOT NULL AS is_held,
    g.is_trend, g.since_ns, g.until_ns, g.before_ns, g.after_ns, g.occasion
FROM named AS h
LEFT JOIN callback_cpu AS c ON h.node = c.node AND h.callback = c.callback
LEFT JOIN held_message AS m
    ON h.node = m.node AND h.callback = m.callback
    AND h.waiting_node = m.waiting_node AND h.topic_name = m.topic_name
LEFT JOIN callback_change AS g ON h.node = g.node AND h.callback = g.callback
-- What a coroutine awaits on the path is no time that it takes.
WHERE h.takes_ns >= h.limit_ns
