-- name: staging.process_life
-- description: Lives of each pid. A new life starts at an rcl_init from another main thread or
--     process name, or of a context handle initialised before without any object of the old life
--     being used after; but never while another thread of the pid goes on.
-- grain: one row per host, PID namespace, pid and life
-- needs: staging.thread_presence, staging.trace, raw
WITH initialisation AS (
    SELECT
        t.host_id,
        i.pid_ns,
        i.vpid,
        i.vtid,
        i.event_id,
        i.ts_ns,
        lag(i.vtid) OVER process IS DISTINCT FROM i.vtid
        OR lag(i.procname) OVER process IS DISTINCT FROM i.procname AS is_other_main,
        row_number() OVER context > 1 AS is_same_context,
        row_number() OVER process > 1 AS is_repeated
    FROM raw.ros2_rcl_init AS i
    JOIN staging.trace AS t ON i.trace_index + 1 = t.trace_id
    WINDOW
        process AS (PARTITION BY t.host_id, i.pid_ns, i.vpid ORDER BY i.event_id),
        context AS (
            PARTITION BY t.host_id, i.pid_ns, i.vpid, i.context_handle ORDER BY i.event_id
        )
),
candidate AS (
    SELECT host_id, pid_ns, vpid, vtid, event_id, is_other_main
    FROM initialisation
    WHERE is_repeated AND (is_other_main OR is_same_context)
),
made AS (
    SELECT trace_index, pid_ns, vpid, event_id, publisher_handle AS handle
    FROM raw.ros2_rcl_publisher_init
    UNION ALL
    SELECT trace_index, pid_ns, vpid, event_id, callback
    FROM raw.ros2_rclcpp_callback_register
),
used AS (
    SELECT trace_index, pid_ns, vpid, event_id, publisher_handle AS handle
    FROM raw.ros2_rcl_publish
    UNION ALL
    SELECT trace_index, pid_ns, vpid, event_id, callback
    FROM raw.ros2_callback_start
),
-- An object made before and used afterwards, without being made again: the life goes on.
surviving AS (
    SELECT DISTINCT c.event_id
    FROM candidate AS c
    JOIN staging.trace AS t ON c.host_id = t.host_id
    JOIN used AS u
        ON t.trace_id - 1 = u.trace_index
        AND c.pid_ns IS NOT DISTINCT FROM u.pid_ns
        AND c.vpid = u.vpid
        AND u.event_id > c.event_id
    ASOF JOIN made AS m
        ON u.trace_index = m.trace_index
        AND u.pid_ns IS NOT DISTINCT FROM m.pid_ns
        AND u.vpid = m.vpid
        AND u.handle = m.handle
        AND u.event_id >= m.event_id
    WHERE m.event_id < c.event_id
),
split AS (
    SELECT i.host_id, i.pid_ns, i.vpid, i.event_id
    FROM candidate AS i
    WHERE (i.is_other_main OR i.event_id NOT IN (SELECT event_id FROM surviving))
        AND NOT EXISTS (
            SELECT 1
            FROM staging.thread_presence AS p
            WHERE p.host_id = i.host_id
                AND p.pid_ns IS NOT DISTINCT FROM i.pid_ns
                AND p.vpid = i.vpid
                AND p.vtid <> i.vtid
                AND p.first_event_id < i.event_id
                AND p.last_event_id > i.event_id
        )
),
start AS (
    SELECT host_id, pid_ns, vpid, 0::BIGINT AS from_event_id
    FROM staging.thread_presence
    GROUP BY ALL
    UNION ALL
    SELECT host_id, pid_ns, vpid, event_id FROM split
)
SELECT
    host_id,
    pid_ns,
    vpid,
    row_number() OVER life AS life,
    from_event_id,
    lead(from_event_id, 1, 9223372036854775807) OVER life AS until_event_id
FROM start
WINDOW life AS (PARTITION BY host_id, pid_ns, vpid ORDER BY from_event_id)
