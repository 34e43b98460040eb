-- title: What the threads of callbacks did while these ran
-- description: From a kernel trace; where some take much longer than usual, of these.
-- grain: one row per node and callback
-- when: main.thread_state
-- reads: callback_name, callback_use
-- column: node VARCHAR  Node
-- column: callback VARCHAR  What triggers it
-- column: run_ns BIGINT [ns]  Sum of their durations
-- column: running_ns BIGINT [ns]  Part of it: on a CPU
-- column: waiting_ns BIGINT [ns]  Part of it: ready, and without a CPU
-- column: sleeping_ns BIGINT [ns]  Part of it: asleep
-- column: disk_ns BIGINT [ns]  Part of it: waiting for a page or a disk
SELECT
    n.node, n.callback,
    sum(i.end_ns - i.start_ns)::BIGINT AS run_ns,
    sum(s.running_ns)::BIGINT AS running_ns,
    sum(s.preempted_ns + s.runnable_ns)::BIGINT AS waiting_ns,
    sum(s.sleeping_ns)::BIGINT AS sleeping_ns,
    sum(s.uninterruptible_ns)::BIGINT AS disk_ns
FROM main.callback_schedule AS s
JOIN main.callback_instance AS i ON s.callback_instance_id = i.callback_instance_id
JOIN callback_name AS n ON i.callback_id = n.callback_id
JOIN callback_use AS u ON n.node = u.node AND n.callback = u.callback
WHERE list_contains($runs, i.run_id)
    AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
    AND 2 * (i.end_ns - i.start_ns) > coalesce(u.long_ns, 0)
GROUP BY n.node, n.callback
