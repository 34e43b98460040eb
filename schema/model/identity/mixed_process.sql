-- name: staging.mixed_process
-- description: Ids that several processes have at one time, whose events nothing tells apart.
--     Either a thread was on two CPUs at one moment. Or an object of one process was made or used
--     after another process had made its first: all GIDs that Fast DDS gives to a process begin
--     with the same eight bytes, two of them random. What is used behind a gap proves nothing: its
--     object may have been made again in it, by a later process.
-- grain: one row per host, PID namespace and pid
WITH thread AS (
    SELECT
        thread_index, host_id, pid_ns, vpid,
        dense_rank() OVER (ORDER BY host_id, pid_ns, vpid) AS process
    FROM staging.thread_seen
),
made AS (
    SELECT event_id, ts_ns, trace_index, thread_index, rmw_publisher_handle AS handle, gid
    FROM raw.ros2_rmw_publisher_init
    UNION ALL
    SELECT event_id, ts_ns, trace_index, thread_index, rmw_subscription_handle, gid
    FROM raw.ros2_rmw_subscription_init
),
identified AS (
    SELECT t.process, m.event_id, m.ts_ns, m.trace_index, m.handle, m.gid[:8] AS prefix
    FROM made AS m
    JOIN thread AS t ON m.thread_index = t.thread_index
    WHERE m.gid[:2] = [1, 15]
    WINDOW process AS (PARTITION BY t.process)
    QUALIFY min(prefix) OVER process < max(prefix) OVER process
),
endpoint AS (
    SELECT
        i.process, i.event_id, i.handle, i.prefix, min(g.start_ns) AS gap_ns
    FROM identified AS i
    JOIN staging.recording AS r ON i.trace_index = r.trace_index
    LEFT JOIN staging.recording_gap AS g
        ON r.recording_index = g.recording_index AND i.ts_ns < g.covered_until_ns
    GROUP BY ALL
),
-- Hardly any recording has one: then nothing below reads the publications and takes.
suspect AS (
    SELECT thread_index, process FROM thread WHERE process IN (SELECT process FROM endpoint)
),
object AS (
    SELECT process, event_id, handle, prefix, gap_ns FROM endpoint
    UNION ALL
    SELECT s.process, p.event_id, p.publisher_handle, e.prefix, e.gap_ns
    FROM raw.ros2_rcl_publisher_init AS p
    JOIN suspect AS s ON p.thread_index = s.thread_index
    ASOF JOIN endpoint AS e
        ON s.process = e.process
        AND p.rmw_publisher_handle = e.handle
        AND p.event_id >= e.event_id
),
used AS (
    SELECT event_id, ts_ns, thread_index, publisher_handle AS handle FROM raw.ros2_rcl_publish
    UNION ALL
    SELECT event_id, ts_ns, thread_index, rmw_subscription_handle FROM raw.ros2_rmw_take
),
shown AS (
    SELECT process, prefix, event_id FROM endpoint
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
FROM thread
WHERE thread_index IN (SELECT thread_index FROM raw.cpu_return)
    OR process IN (SELECT process FROM several)
