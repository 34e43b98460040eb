-- title: What callbacks did with their time
-- description: By callback, all its instances that began in the window together, where the kernel
--     was traced.
-- grain: one row per callback
-- column: node VARCHAR [node]  Its node
-- column: what VARCHAR  The callback
-- column: running HUGEINT  On a CPU, ns
-- column: run_queue HUGEINT  Waiting for one, ns
-- column: sleeping HUGEINT  Asleep, or waiting for the disk, ns
SELECT
    l.node,
    l.label AS what,
    sum(s.running_ns) AS running,
    sum(s.preempted_ns + s.runnable_ns) AS run_queue,
    sum(s.sleeping_ns + s.uninterruptible_ns) AS sleeping
FROM main.callback_schedule AS s
JOIN main.callback_instance AS i ON s.callback_instance_id = i.callback_instance_id
JOIN main.callback_label AS l ON i.callback_id = l.callback_id
WHERE i.run_id = $run_id AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
GROUP BY l.node, l.label
ORDER BY l.node, l.label
