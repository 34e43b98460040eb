-- title: A topic that fell silent
-- description: The node published on the topic at regular times, and from some moment on until the
--     end of the recording not once, for ten of its periods and a second at least. Its process goes
--     on, so do the callbacks that it has, and nothing in the trace shows that it had to stop: it
--     names what began or ended then.
-- cause: A loop or thread of the node ended or waits (a driver, a controller), the node changed
--     what it does, or its input comes from where nothing is traced.
-- cure: None needed if the node means to. Else see what it waits for: its output, and gdb -p PID,
--     thread apply all bt. msgflow query changes shows all that changed then.
-- grain: one row per node and topic
-- severity: warning
-- next: query changes
-- when: main.stopped_series
SELECT
    s.run_id,
    s.node_id AS publishing_node_id,
    s.topic_name, s.subject, s.count,
    printf('until %.3f s %s', (s.at_ns - r.start_ns) / 1e9, s.sentence) AS detail
FROM silent_series AS s
JOIN main.run AS r ON s.run_id = r.run_id
WHERE s.what = 'topic'
