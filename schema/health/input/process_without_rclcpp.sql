-- title: A process that does not use rclcpp
-- description: The process was seen to create nodes and to publish through rcl, and has no event
--     of rclcpp, although these were enabled. So there are no callbacks, durations or executor
--     states of it. A message is taken to have caused what its thread sent before the next take:
--     what a timer of the process sent in that time may look the same (doubtful_answer). Its timers
--     include those that rclpy makes for waits with a timeout.
-- cause: It is written in Python (rclpy) or uses another client library. These have no tracepoints
--     of their own.
-- cure: Record Python nodes with msgflow record -- COMMAND, or start them with the folder that
--     msgflow record --print-python-path prints in front of PYTHONPATH (no rebuild). Where the
--     detail says that Python is traced, nothing more is to be had: an EventsExecutor of rclpy
--     shows nothing, and what a program takes by itself has no callback.
-- next: query path-breakdown
-- grain: one row per process
-- severity: warning
-- when: staging.process WHERE process_id NOT IN (SELECT process_id FROM staging.callback)
--     OR python_version IS NOT NULL
WITH enabled AS (SELECT trace_index FROM staging.declared WHERE name = 'ros2:callback_start'),
rclcpp AS (
    SELECT process_id
    FROM staging.callback
    WHERE process_id NOT IN (
        SELECT process_id FROM staging.process WHERE python_version IS NOT NULL
    )
    UNION
    SELECT process_id FROM staging.callback_run
    UNION
    SELECT t.process_id
    FROM staging.thread AS t
    SEMI JOIN staging.executor_first AS x ON t.thread_id = x.thread_id
),
sent AS (
    SELECT
        p.process_id,
        bool_and(p.trace_index IN (SELECT trace_index FROM enabled)) AS is_enabled,
        bool_or(p.rclcpp_ns IS NOT NULL OR p.intra_ns IS NOT NULL) AS has_rclcpp,
        count(*) AS number
    FROM staging.publication_call AS p
    ANTI JOIN rclcpp AS r ON p.process_id = r.process_id
    GROUP BY p.process_id
),
timed AS (
    SELECT
        process_id,
        count(*) AS number
    FROM staging.timer
    GROUP BY process_id
),
-- One of rclcpp that was there before the recording may only have logged. Of rclpy all processes
-- have one name, so that only their nodes tell them apart.
named AS (
    SELECT
        process_id,
        string_agg(full_name, ', ' ORDER BY node_id) AS nodes,
        CASE WHEN count(*) = 1 THEN min(node_id) END AS node_id
    FROM staging.node
    WHERE NOT is_inferred
    GROUP BY process_id
)
SELECT
    s.process_id, n.node_id,
    printf('%s (%s)', n.nodes, l.label) AS subject,
    s.number AS count,
    printf('publications: %d, timers: %d, callbacks: none', s.number, coalesce(t.number, 0))
    || CASE WHEN y.python_version IS NULL THEN '' ELSE ', though its Python is traced' END
        AS detail
FROM sent AS s
JOIN named AS n ON s.process_id = n.process_id
JOIN staging.process AS y ON s.process_id = y.process_id
LEFT JOIN timed AS t ON s.process_id = t.process_id
JOIN process_label AS l ON s.process_id = l.process_id
WHERE s.is_enabled AND NOT s.has_rclcpp
