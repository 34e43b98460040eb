-- title: Tracing started after ROS
-- description: Objects were used whose creation is not in the trace. They are placeholders with no
--     name, or with one deduced from messages. So topics and nodes are missing from results. Not
--     counted: objects of ROS itself (/rosout is published on handles that are never initialised),
--     and processes that may have lost these events (initialisation_lost).
-- cause: The session was started after the nodes, or the events of initialisation were not enabled.
-- cure: Start the session first: ros2 trace, or the Trace action at the head of the launch file; or
--     record initialisation into a snapshot session that runs all the time, and ingest both.
-- grain: one row per process
-- severity: warning
-- when: store.node WHERE is_inferred, store.publisher WHERE is_inferred AND NOT is_internal,
--     store.subscription WHERE is_inferred AND NOT is_internal,
--     store.timer WHERE created_ns IS NULL, store.service WHERE created_ns IS NULL,
--     store.client WHERE created_ns IS NULL, store.callback WHERE created_ns IS NULL
SELECT p.run_id, u.process_id, u.count, u.detail
FROM derive.unseen_creation AS u
JOIN main.process AS p ON u.process_id = p.process_id
WHERE NOT u.is_lossy
