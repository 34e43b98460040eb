-- description: Threads within the life of their process. An event is of the thread and process of
--     the row that has its thread index, and in whose stretch of event ids it lies.
-- grain: one row per thread of a process life
-- when: raw.thread_name

-- When each thread was seen, by the name that it had then. A name may come again.
CREATE OR REPLACE TEMP TABLE thread_presence AS
SELECT
    r.thread_index, s.host_id, r.pid_ns, r.vpid, r.vtid, n.procname, n.first_event_id,
    n.last_event_id, n.first_seen_ns, n.last_seen_ns
FROM raw.thread_name AS n
JOIN raw.thread AS r ON n.thread_index = r.thread_index
JOIN staging.placed_source AS s ON r.trace_index = s.trace_index;

-- Where a pid begins a new life. That is an rcl_init which is not the first event of its process,
-- in three cases. (1) Its context handle was initialised before. (2) It is the first one recorded,
-- and a publisher was made or a callback was seen before it. (3) The main thread or the process
-- name differs from that of the rcl_init before. In (1) and (2), the life goes on if a publisher or
-- callback of it is used afterwards without being made again, or if a callback ends that began
-- before. (Threads that seem to go on prove nothing there: containers number them alike in every
-- life.) What is used behind a gap proves nothing: its object may have been made again in the gap,
-- and a restart is likelier than a second context. In (3), the life goes on if another thread does.
-- when: raw.ros2_rcl_init WHERE event_id NOT IN (
--     SELECT min(first_event_id) FROM thread_presence GROUP BY host_id, pid_ns, vpid)
-- columns: host_id BIGINT, pid_ns BIGINT, vpid INTEGER, event_id BIGINT
CREATE OR REPLACE TEMP TABLE process_restart AS
-- `is_other_main`: another thread, or another process name, than that of the rcl_init before.
WITH every_initialisation AS (
    SELECT
        p.host_id, p.pid_ns, p.vpid, p.vtid, i.event_id, i.ts_ns, i.trace_index,
        lag(p.vtid) OVER process IS DISTINCT FROM p.vtid
        OR lag(p.procname) OVER process IS DISTINCT FROM p.procname AS is_other_main,
        row_number() OVER context > 1 AS is_same_context,
        row_number() OVER process > 1 AS is_repeated
    FROM raw.ros2_rcl_init AS i
    ASOF JOIN thread_presence AS p
        ON i.thread_index = p.thread_index AND i.event_id >= p.first_event_id
    WINDOW
        process AS (PARTITION BY p.host_id, p.pid_ns, p.vpid ORDER BY i.event_id),
        context AS (PARTITION BY p.host_id, p.pid_ns, p.vpid, i.context_handle ORDER BY i.event_id)
),
-- Most are the first event of their process. `gap_ns`: begin of the first gap behind it.
initialisation AS (
    SELECT
        i.*,
        coalesce(min(g.start_ns), 9223372036854775807) AS gap_ns
    FROM every_initialisation AS i
    JOIN staging.placed_source AS r ON i.trace_index = r.trace_index
    LEFT JOIN staging.gap AS g
        ON r.recording_index = g.recording_index AND i.ts_ns < g.covered_until_ns
    WHERE i.event_id NOT IN (
        SELECT min(first_event_id) FROM thread_presence GROUP BY host_id, pid_ns, vpid
    )
    GROUP BY ALL
),
thread AS (SELECT DISTINCT thread_index, host_id, pid_ns, vpid, vtid FROM thread_presence),
-- A callback that starts was registered, whether that was recorded or not. A publication shows no
-- object: what logs to /rosout publishes on a handle that is never made.
handled AS (
    SELECT
        thread_index, event_id, ts_ns,
        publisher_handle AS handle,
        true AS is_made,
        true AS shows_object
    FROM raw.ros2_rcl_publisher_init
    UNION ALL
    SELECT thread_index, event_id, ts_ns, callback, true, true
    FROM raw.ros2_rclcpp_callback_register
    -- What the tracer of Python nodes says besides is of no object.
    WHERE symbol IS NULL OR symbol NOT LIKE '#msgflow %' OR symbol LIKE '#msgflow function %'
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
            FROM thread_presence AS p
            WHERE p.host_id = i.host_id
                AND p.pid_ns IS NOT DISTINCT FROM i.pid_ns
                AND p.vpid = i.vpid
                AND p.vtid <> i.vtid
                AND p.first_event_id < i.event_id
                AND p.last_event_id > i.event_id
        )
    );

WITH start AS (
    SELECT host_id, pid_ns, vpid, -9223372036854775807 AS from_event_id
    FROM thread_presence
    GROUP BY ALL
    UNION ALL
    SELECT host_id, pid_ns, vpid, event_id FROM process_restart
),
life AS (
    SELECT
        host_id, pid_ns, vpid, from_event_id,
        row_number() OVER of_pid AS life,
        lead(from_event_id, 1, 9223372036854775807) OVER of_pid AS until_event_id
    FROM start
    WINDOW of_pid AS (PARTITION BY host_id, pid_ns, vpid ORDER BY from_event_id)
),
lived AS (
    SELECT
        p.thread_index, l.host_id, l.pid_ns, l.vpid, p.vtid, l.life, l.from_event_id,
        l.until_event_id, p.procname, p.first_event_id, p.last_event_id, p.first_seen_ns,
        p.last_seen_ns
    FROM thread_presence AS p
    JOIN life AS l
        ON p.host_id = l.host_id
        AND p.pid_ns IS NOT DISTINCT FROM l.pid_ns
        AND p.vpid = l.vpid
        AND p.last_event_id >= l.from_event_id
        AND p.first_event_id < l.until_event_id
),
-- A stretch that two lives share has to be looked at event by event.
divided AS (
    SELECT
        v.thread_index, v.life,
        min(e.event_id) AS first_event_id,
        max(e.event_id) AS last_event_id,
        min(e.ts_ns) AS first_seen_ns,
        max(e.ts_ns) AS last_seen_ns
    FROM lived AS v
    JOIN staging.event AS e
        ON v.thread_index = e.thread_index
        AND e.event_id >= v.first_event_id
        AND e.event_id <= v.last_event_id
        AND e.event_id >= v.from_event_id
        AND e.event_id < v.until_event_id
    WHERE v.first_event_id < v.from_event_id OR v.last_event_id >= v.until_event_id
    GROUP BY ALL
),
thread AS (
    SELECT
        v.thread_index, v.host_id, v.pid_ns, v.vpid, v.life, v.from_event_id, v.until_event_id,
        v.vtid AS tid,
        arg_max(v.procname, v.last_event_id) AS name,
        min(coalesce(d.first_event_id, v.first_event_id)) AS first_event_id,
        max(coalesce(d.last_event_id, v.last_event_id)) AS last_event_id,
        min(coalesce(d.first_seen_ns, v.first_seen_ns)) AS first_seen_ns,
        max(coalesce(d.last_seen_ns, v.last_seen_ns)) AS last_seen_ns
    FROM lived AS v
    LEFT JOIN divided AS d
        ON v.thread_index = d.thread_index
        AND v.life = d.life
        AND (v.first_event_id < v.from_event_id OR v.last_event_id >= v.until_event_id)
    WHERE d.life IS NOT NULL
        OR (v.first_event_id >= v.from_event_id AND v.last_event_id < v.until_event_id)
    GROUP BY ALL
),
of_process AS (
    SELECT
        *,
        min(first_event_id) OVER (PARTITION BY host_id, pid_ns, vpid, life)
            AS process_first_event_id
    FROM thread
)
SELECT
    * EXCLUDE (process_first_event_id),
    row_number() OVER (ORDER BY first_event_id) AS thread_id,
    dense_rank() OVER (ORDER BY process_first_event_id) AS process_id
FROM of_process
