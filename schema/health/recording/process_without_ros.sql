-- title: A traced process has no ROS events
-- description: The trace has events of the process, but no node, publisher, subscription, service,
--     client, timer or callback. What it does with messages is not known. A process that began to
--     use ROS and has no node yet is still starting.
-- cause: It runs with a tracetools that was built without LTTng, or it is not a ROS process.
-- cure: In its environment, ros2 run tracetools status must say that tracing is enabled; if it does
--     not, build tracetools with LTTng installed. Start the process with the events of ROS enabled.
-- grain: one row per process
-- severity: warning
-- when: store.process WHERE process_id NOT IN (SELECT process_id FROM store.node)
SELECT
    run_id, process_id,
    1::BIGINT AS count,
    printf('seen for %.3f s', (last_seen_ns - first_seen_ns) / 1e9) AS detail
FROM main.process
WHERE coalesce(tracetools_version, python_version) IS NULL AND process_id NOT IN (
    SELECT process_id FROM main.node
    UNION ALL
    SELECT process_id FROM main.publisher
    UNION ALL
    SELECT process_id FROM main.subscription
    UNION ALL
    SELECT process_id FROM main.callback
    UNION ALL
    SELECT process_id FROM main.timer
    UNION ALL
    SELECT process_id FROM main.service
    UNION ALL
    SELECT process_id FROM main.client
)
