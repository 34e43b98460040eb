-- description: Process lives. The name is that of the main thread (tid = pid), else of the first
--     thread seen; the version is what rcl_init stated, for display only. The tracer of Python
--     nodes says that of Python.
-- grain: one row per process life
-- when: staging.thread

-- `process` numbers what has the same ids.
CREATE OR REPLACE TEMP TABLE id_thread AS
SELECT DISTINCT
    thread_index, host_id, pid_ns, vpid,
    dense_rank() OVER (ORDER BY host_id, pid_ns, vpid) AS process
FROM staging.thread;

-- Publishers and subscriptions of ids under which objects of several processes were made: all GIDs
-- that Fast DDS gives to a process begin with the same eight bytes, two of them random. `gap_ns`:
-- begin of the first gap behind it.
-- when: raw.ros2_rmw_publisher_init, raw.ros2_rmw_subscription_init
-- columns: process BIGINT, event_id BIGINT, handle UBIGINT, prefix UTINYINT[], gap_ns BIGINT
CREATE OR REPLACE TEMP TABLE foreign_endpoint AS
WITH made AS (
    SELECT
        event_id, ts_ns, trace_index, thread_index,
        rmw_publisher_handle AS handle,
        gid
    FROM raw.ros2_rmw_publisher_init
    UNION ALL
    SELECT event_id, ts_ns, trace_index, thread_index, rmw_subscription_handle, gid
    FROM raw.ros2_rmw_subscription_init
),
identified AS (
    SELECT
        t.process, m.event_id, m.ts_ns, m.trace_index, m.handle,
        m.gid[:8] AS prefix
    FROM made AS m
    JOIN id_thread AS t ON m.thread_index = t.thread_index
    WHERE m.gid[:2] = [1, 15]
    WINDOW process AS (PARTITION BY t.process)
    QUALIFY min(prefix) OVER process < max(prefix) OVER process
)
SELECT
    i.process, i.event_id, i.handle, i.prefix,
    min(g.start_ns) AS gap_ns
FROM identified AS i
JOIN staging.placed_source AS r ON i.trace_index = r.trace_index
LEFT JOIN staging.gap AS g ON r.recording_index = g.recording_index AND i.ts_ns < g.covered_until_ns
GROUP BY ALL;

-- Ids that several processes have at one time, whose events nothing tells apart. Either a thread
-- was on two CPUs at one moment. Or an object of one process was made or used after another process
-- had made its first. What is used behind a gap proves nothing: its object may have been made again
-- in it, by a later process.
-- when: foreign_endpoint, raw.cpu_return
-- columns: host_id BIGINT, pid_ns BIGINT, vpid INTEGER
CREATE OR REPLACE TEMP TABLE mixed_process AS
WITH suspect AS (
    SELECT thread_index, process
    FROM id_thread
    WHERE process IN (SELECT process FROM foreign_endpoint)
),
object AS (
    SELECT process, event_id, handle, prefix, gap_ns FROM foreign_endpoint
    UNION ALL
    SELECT s.process, p.event_id, p.publisher_handle, e.prefix, e.gap_ns
    FROM raw.ros2_rcl_publisher_init AS p
    JOIN suspect AS s ON p.thread_index = s.thread_index
    ASOF JOIN foreign_endpoint AS e
        ON s.process = e.process AND p.rmw_publisher_handle = e.handle AND p.event_id >= e.event_id
),
used AS (
    SELECT
        event_id, ts_ns, thread_index,
        publisher_handle AS handle
    FROM raw.ros2_rcl_publish
    UNION ALL
    SELECT event_id, ts_ns, thread_index, rmw_subscription_handle
    FROM raw.ros2_rmw_take
),
shown AS (
    SELECT process, prefix, event_id FROM foreign_endpoint
    UNION ALL
    SELECT o.process, o.prefix, u.event_id
    FROM used AS u
    JOIN suspect AS s ON u.thread_index = s.thread_index
    ASOF JOIN object AS o
        ON s.process = o.process AND u.handle = o.handle AND u.event_id >= o.event_id
    WHERE coalesce(u.ts_ns <= o.gap_ns, true)
),
several AS (
    SELECT process
    FROM shown
    GROUP BY process, prefix
    QUALIFY max(event_id) > lead(min(event_id)) OVER (PARTITION BY process ORDER BY min(event_id))
)
SELECT DISTINCT host_id, pid_ns, vpid
FROM id_thread
WHERE thread_index IN (SELECT thread_index FROM raw.cpu_return)
    OR process IN (SELECT process FROM several);

WITH process AS (
    SELECT
        process_id, host_id, pid_ns, vpid, life,
        coalesce(any_value(name) FILTER (WHERE tid = vpid), arg_min(name, first_event_id)) AS name,
        min(first_seen_ns) AS first_seen_ns,
        max(last_seen_ns) AS last_seen_ns
    FROM staging.thread
    GROUP BY ALL
),
version AS (
    SELECT
        process_id,
        arg_min(version, event_id) AS tracetools_version
    FROM staging.located('raw.ros2_rcl_init')
    GROUP BY process_id
)
SELECT
    p.process_id, p.host_id,
    p.vpid AS pid,
    p.name, v.tracetools_version, y.python_version, p.first_seen_ns, p.last_seen_ns,
    p.pid_ns AS pid_namespace,
    p.life::INTEGER AS life,
    m.vpid IS NOT NULL AS is_ambiguous
FROM process AS p
LEFT JOIN version AS v ON p.process_id = v.process_id
LEFT JOIN (
    SELECT
        process_id,
        coalesce(any_value(text) FILTER (WHERE kind = 'python'), '?')
            AS python_version
    FROM staging.python_mark
    GROUP BY process_id
) AS y ON p.process_id = y.process_id
LEFT JOIN mixed_process AS m
    ON p.host_id = m.host_id AND p.pid_ns IS NOT DISTINCT FROM m.pid_ns AND p.vpid = m.vpid
