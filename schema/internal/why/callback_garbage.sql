-- title: Callbacks in which Python collected garbage
-- description: Where some take much longer than usual, of these.
-- grain: one row per node and callback
-- when: main.garbage_collection
-- reads: callback_name, callback_use
-- column: node VARCHAR  Node
-- column: callback VARCHAR  What triggers it
-- column: run_ns BIGINT [ns]  Sum of their durations
-- column: garbage_ns BIGINT [ns]  Part of it: collections of garbage
SELECT
    n.node, n.callback,
    sum(i.end_ns - i.start_ns)::BIGINT AS run_ns,
    coalesce(sum(g.garbage_ns), 0)::BIGINT AS garbage_ns
FROM main.callback_instance AS i
JOIN callback_name AS n ON i.callback_id = n.callback_id
JOIN callback_use AS u ON n.node = u.node AND n.callback = u.callback
LEFT JOIN (
    SELECT
        callback_instance_id,
        sum(end_ns - start_ns) AS garbage_ns
    FROM main.garbage_collection
    WHERE list_contains($runs, run_id)
    GROUP BY callback_instance_id
) AS g
    ON i.callback_instance_id = g.callback_instance_id
WHERE list_contains($runs, i.run_id)
    AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
    AND i.end_ns - i.start_ns > u.longer_ns
GROUP BY n.node, n.callback
