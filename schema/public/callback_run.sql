-- description: Callback instances with the names of what they belong to: those of
--     main.callback_instance, each with its callback, node, process, host and thread.
-- grain: one row per callback instance
-- column: callback_instance_id BIGINT  Identity of the callback instance
-- column: run_id
-- column: start_ns BIGINT [epoch ns]  callback_start
-- column: duration_ns BIGINT [ns]  From its start to its end; NULL: never seen to end
-- column: node VARCHAR  Full name of the node, or the name and pid of the process in brackets
-- column: callback VARCHAR  What triggers it
-- column: process, pid, tid, host, callback_id
-- column: take_id BIGINT  Message it was called with
-- column: is_internal
SELECT
    i.callback_instance_id, i.run_id, i.start_ns,
    i.end_ns - i.start_ns AS duration_ns,
    l.node,
    l.label AS callback,
    p.name AS process,
    p.pid, t.tid,
    h.hostname AS host,
    i.callback_id, i.take_id, l.is_internal
FROM main.callback_instance AS i
JOIN main.callback_label AS l ON i.callback_id = l.callback_id
JOIN store.process AS p ON i.process_id = p.process_id
JOIN store.host AS h ON p.host_id = h.host_id
LEFT JOIN store.thread AS t ON i.thread_id = t.thread_id
