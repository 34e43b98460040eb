-- name: staging.later_initialisation
-- description: Initialisations of ROS that are not the first event of their process, which most
--     are. `is_other_main`: by another thread, or under another name, than the one before.
-- grain: one row per such rcl_init
-- when: raw.ros2_rcl_init
WITH initialisation AS (
    SELECT
        p.host_id,
        p.pid_ns,
        p.vpid,
        p.vtid,
        i.event_id,
        i.ts_ns,
        i.trace_index,
        lag(p.vtid) OVER process IS DISTINCT FROM p.vtid
        OR lag(p.procname) OVER process IS DISTINCT FROM p.procname AS is_other_main,
        row_number() OVER context > 1 AS is_same_context,
        row_number() OVER process > 1 AS is_repeated
    FROM raw.ros2_rcl_init AS i
    ASOF JOIN staging.thread_presence AS p
        ON i.thread_index = p.thread_index AND i.event_id >= p.first_event_id
    WINDOW
        process AS (PARTITION BY p.host_id, p.pid_ns, p.vpid ORDER BY i.event_id),
        context AS (
            PARTITION BY p.host_id, p.pid_ns, p.vpid, i.context_handle ORDER BY i.event_id
        )
)
SELECT i.*
FROM initialisation AS i
WHERE EXISTS (
    SELECT 1
    FROM staging.thread_presence AS p
    WHERE p.host_id = i.host_id
        AND p.pid_ns IS NOT DISTINCT FROM i.pid_ns
        AND p.vpid = i.vpid
        AND p.first_event_id < i.event_id
)
