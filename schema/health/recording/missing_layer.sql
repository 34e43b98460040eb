-- name: finding.missing_layer
-- title: A kind of event is missing altogether
-- description: The traces lack a kind of event that the other events of the run call for. So a
--     whole part of the answers is empty.
-- cause: The event was not enabled in the session; or the installed ROS 2 or middleware does not
--     have it, even if the metadata of the trace lists it.
-- cure: Enable all events of ROS: lttng enable-event --userspace 'ros2:*' (ros2 trace does), and
--     use a tracetools and a middleware that have them.
-- grain: one row per run and kind
-- severity: warning
WITH layer AS (
    SELECT run_id, 'publication' AS kind FROM main.publication
    UNION ALL
    SELECT run_id, 'take' FROM main.take WHERE method <> 'callback_only'
    UNION ALL
    SELECT run_id, 'callback' FROM main.callback_instance
    UNION ALL
    SELECT run_id, 'state' FROM main.executor_state
),
counted AS (
    SELECT
        r.run_id,
        sum(CASE WHEN l.kind = 'publication' THEN 1 ELSE 0 END) AS publications,
        sum(CASE WHEN l.kind = 'take' THEN 1 ELSE 0 END) AS takes,
        sum(CASE WHEN l.kind = 'callback' THEN 1 ELSE 0 END) AS callbacks,
        sum(CASE WHEN l.kind = 'state' THEN 1 ELSE 0 END) AS states
    FROM main.run AS r
    LEFT JOIN layer AS l ON r.run_id = l.run_id
    GROUP BY r.run_id
)
SELECT run_id, 'everything' AS subject, 1::BIGINT AS count,
    'nothing was published or taken and no callback ran, as far as traced: no answers' AS detail
FROM counted
WHERE publications + takes + callbacks = 0
UNION ALL
SELECT run_id, 'publications', 1,
    'nothing was published as far as traced (rcl_publish, rclcpp_publish, rmw_publish): no flows'
FROM counted
WHERE publications = 0 AND takes + callbacks > 0
UNION ALL
SELECT run_id, 'takes', 1,
    'no message was taken as far as traced (rmw_take, rcl_take): no transport, no flows'
FROM counted
WHERE takes = 0 AND publications + callbacks > 0
UNION ALL
SELECT run_id, 'callbacks', 1,
    'no callback ran as far as traced (callback_start, callback_end): no causes, no durations'
FROM counted
WHERE callbacks = 0 AND publications + takes > 0
UNION ALL
SELECT run_id, 'executors', 1,
    'no event of an executor (rclcpp_executor_wait_for_work and others): no executor states'
FROM counted
WHERE states = 0 AND callbacks > 0
