-- description: Where a pid begins a new life. That is an rcl_init which is not the first event of
--     its process, in three cases. (1) Its context handle was initialised before. (2) It is the
--     first one recorded, and a publisher was made or a callback was seen before it. (3) The main
--     thread or the process name differs from that of the rcl_init before. In (1) and (2), the life
--     goes on if a publisher or callback of it is used afterwards without being made again, or if a
--     callback ends that began before. (Threads that seem to go on prove nothing there: containers
--     number them alike in every life.) What is used behind a gap proves nothing: its object may
--     have been made again in the gap, and a restart is likelier than a second context. In (3), the
--     life goes on if another thread does.
-- grain: one row per such rcl_init
-- when: raw.ros2_rcl_init WHERE event_id NOT IN (
--     SELECT min(first_event_id) FROM staging.thread_presence GROUP BY host_id, pid_ns, vpid)

-- `is_other_main`: another thread, or another process name, than that of the rcl_init before.
WITH every_initialisation AS (
    SELECT
        p.host_id, p.pid_ns, p.vpid, p.vtid, i.event_id, i.ts_ns, i.trace_index,
        lag(p.vtid) OVER process IS DISTINCT FROM p.vtid
        OR lag(p.procname) OVER process IS DISTINCT FROM p.procname AS is_other_main,
        row_number() OVER context > 1 AS is_same_context,
        row_number() OVER process > 1 AS is_repeated
    FROM raw.ros2_rcl_init AS i
    ASOF JOIN staging.thread_presence AS p
        ON i.thread_index = p.thread_index AND i.event_id >= p.first_event_id
    WINDOW
        process AS (PARTITION BY p.host_id, p.pid_ns, p.vpid ORDER BY i.event_id),
        context AS (PARTITION BY p.host_id, p.pid_ns, p.vpid, i.context_handle ORDER BY i.event_id)
),
-- Most are the first event of their process. `gap_ns`: begin of the first gap behind it.
initialisation AS (
    SELECT i.*, coalesce(min(g.start_ns), 9223372036854775807) AS gap_ns
    FROM every_initialisation AS i
    JOIN staging.placed_source AS r ON i.trace_index = r.trace_index
    LEFT JOIN staging.gap AS g
        ON r.recording_index = g.recording_index AND i.ts_ns < g.covered_until_ns
    WHERE i.event_id NOT IN (
        SELECT min(first_event_id) FROM staging.thread_presence GROUP BY host_id, pid_ns, vpid
    )
    GROUP BY ALL
),
thread AS (SELECT DISTINCT thread_index, host_id, pid_ns, vpid, vtid FROM staging.thread_presence),
-- A callback that starts was registered, whether that was recorded or not. A publication shows no
-- object: what logs to /rosout publishes on a handle that is never made.
handled AS (
    SELECT
        thread_index, event_id, ts_ns, publisher_handle AS handle, true AS is_made,
        true AS shows_object
    FROM raw.ros2_rcl_publisher_init
    UNION ALL
    SELECT thread_index, event_id, ts_ns, callback, true, true
    FROM raw.ros2_rclcpp_callback_register
    UNION ALL
    SELECT thread_index, event_id, ts_ns, publisher_handle, false, false FROM raw.ros2_rcl_publish
    UNION ALL
    SELECT thread_index, event_id, ts_ns, callback, false, true FROM raw.ros2_callback_start
),
-- Objects from before an initialisation: when they are first used after it, and made again.
old AS (
    SELECT
        c.event_id,
        min(h.event_id) FILTER (
            NOT h.is_made AND h.event_id > c.event_id AND h.ts_ns <= c.gap_ns
        ) AS used_event_id,
        min(h.event_id) FILTER (h.is_made AND h.event_id > c.event_id) AS made_event_id
    FROM initialisation AS c
    JOIN thread AS s
        ON c.host_id = s.host_id AND c.pid_ns IS NOT DISTINCT FROM s.pid_ns AND c.vpid = s.vpid
    JOIN handled AS h ON s.thread_index = h.thread_index
    GROUP BY c.event_id, h.handle
    HAVING min(h.event_id) FILTER (h.shows_object) < c.event_id
),
-- An object from before that is used afterwards without being made again, or a callback that began
-- before and ends afterwards: the life goes on. The thread that initialises again is that of the
-- new life. Where the first initialisation is not known, it may do so inside a callback.
surviving AS (
    SELECT event_id FROM old WHERE used_event_id < coalesce(made_event_id, 9223372036854775807)
    UNION
    SELECT c.event_id
    FROM initialisation AS c
    JOIN thread AS s
        ON c.host_id = s.host_id
        AND c.pid_ns IS NOT DISTINCT FROM s.pid_ns
        AND c.vpid = s.vpid
        AND (c.vtid <> s.vtid OR NOT c.is_repeated)
    JOIN raw.ros2_callback_end AS e
        ON s.thread_index = e.thread_index
        AND e.event_id > c.event_id
        AND e.ts_ns <= c.gap_ns
        AND e.previous_callback_event_id < c.event_id
    JOIN raw.ros2_callback_start AS b
        ON e.previous_callback_event_id = b.event_id AND e.callback = b.callback
)
SELECT i.host_id, i.pid_ns, i.vpid, i.event_id
FROM initialisation AS i
WHERE (
        CASE
            WHEN i.is_repeated THEN i.is_same_context
            ELSE i.event_id IN (SELECT event_id FROM old)
        END
        AND i.event_id NOT IN (SELECT event_id FROM surviving)
    )
    OR (
        i.is_repeated
        AND i.is_other_main
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
    )
