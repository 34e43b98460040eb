-- title: A kind of event is missing altogether
-- description: The traces lack a kind of event that the other events of the run call for. So a
--     whole part of the answers is empty.
-- cause: The event was not enabled in the session; or the installed ROS 2 or middleware does not
--     have it, even if the metadata of the trace lists it: those of requests came with Kilted, and
--     rclpy has none of callbacks and executors.
-- cure: Enable all events of ROS: lttng enable-event --userspace 'ros2:*' (ros2 trace does), and
--     use a tracetools and a middleware that have them.
-- grain: one row per run and kind
-- severity: warning
WITH seen AS MATERIALIZED (
    SELECT
        EXISTS (FROM store.publication WHERE run_id = $run_id) AS has_publications,
        EXISTS (FROM store.take WHERE run_id = $run_id AND method <> 'callback_only') AS has_takes,
        EXISTS (FROM store.callback_instance WHERE run_id = $run_id) AS has_callbacks,
        EXISTS (FROM store.executor_state WHERE run_id = $run_id) AS has_states,
        EXISTS (FROM store.request WHERE run_id = $run_id) AS has_requests,
        -- Those were enabled, and some client library or executor has none.
        EXISTS (
            FROM store.finding WHERE run_id = $run_id AND name = 'process_without_rclcpp'
        ) AS is_without_rclcpp,
        EXISTS (
            FROM store.finding
            WHERE run_id = $run_id
                AND name IN (
                    'executor_without_events', 'executor_events_left_out', 'agnocast_callbacks'
                )
        )
        OR EXISTS (FROM store.executor WHERE run_id = $run_id AND kind = 'events')
            AS is_without_executor
    FROM store.run
    WHERE run_id = $run_id
)
SELECT
    $run_id AS run_id,
    'everything' AS layer,
    1::BIGINT AS count,
    'nothing was published or taken and no callback ran, as far as traced: no answers' AS detail
FROM seen
WHERE NOT (has_publications OR has_takes OR has_callbacks)
UNION ALL
SELECT $run_id, 'publications', 1,
    'nothing was published as far as traced (rcl_publish, rclcpp_publish, rmw_publish): no flows'
FROM seen
WHERE NOT has_publications AND (has_takes OR has_callbacks)
UNION ALL
SELECT $run_id, 'takes', 1,
    'no message was taken as far as traced (rmw_take, rcl_take): no transport, no flows'
FROM seen
WHERE NOT has_takes AND (has_publications OR has_callbacks)
UNION ALL
SELECT $run_id, 'callbacks', 1,
    'no callback ran as far as traced (callback_start, callback_end): no causes, no durations'
FROM seen
WHERE NOT (has_callbacks OR is_without_rclcpp) AND (has_publications OR has_takes)
UNION ALL
SELECT $run_id, 'executors', 1,
    'no event of an executor (rclcpp_executor_wait_for_work and others): no executor states'
FROM seen
WHERE NOT (has_states OR is_without_executor) AND has_callbacks
UNION ALL
SELECT
    $run_id, 'requests',
    count(*),
    'callbacks of services ran ' || derive.counted(count(*), 'time')
    || ', and no request was seen (rmw_take_request and others, since Kilted): no calls, no flows '
    || 'through services'
FROM store.callback_instance AS i
JOIN store.callback AS c ON i.callback_id = c.callback_id
JOIN seen ON NOT has_requests
WHERE i.run_id = $run_id AND c.kind = 'service'
HAVING count(*) > 0
UNION ALL
-- Callbacks of action servers have no events.
SELECT
    $run_id, 'goals',
    count(*),
    'action servers published their status ' || derive.counted(count(*), 'time')
    || ', and no request was seen (rmw_take_request and others, since Kilted): no goals, no flows '
    || 'through actions'
FROM store.publication AS b
JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
JOIN seen ON NOT has_requests
WHERE b.run_id = $run_id AND p.topic_name LIKE '%/\_action/status' ESCAPE '\'
HAVING count(*) > 0
