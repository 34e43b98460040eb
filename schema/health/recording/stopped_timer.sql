-- title: A timer that stopped
-- description: The timer was called at regular times, and from some moment on until the end of the
--     recording not once, for ten of its periods and a second at least. Its process goes on, and
--     nothing in the trace shows that it had to stop: it names what began or ended then.
-- cause: It was cancelled, or destroyed (ROS has no event for that), its callback group waits for a
--     lock or a callback of another thread, or the executor has lost it (ros2/rclcpp#3240).
-- cure: None needed if the node cancels it. Else see what its callback waited for last, and what
--     runs on its executor (msgflow query executor-usage). msgflow query changes shows all that
--     changed then.
-- grain: one row per timer
-- severity: warning
-- next: query changes
-- when: main.stopped_series
SELECT
    s.run_id, s.node_id, s.subject, s.count,
    printf('until %.3f s %s', (s.at_ns - r.start_ns) / 1e9, s.sentence) AS detail
FROM silent_series AS s
JOIN main.run AS r ON s.run_id = r.run_id
WHERE s.what = 'timer'
