-- description: Ids that several processes have at one time, whose events nothing tells apart.
--     Either a thread was on two CPUs at one moment. Or an object of one process was made or used
--     after another process had made its first. What is used behind a gap proves nothing: its
--     object may have been made again in it, by a later process.
-- grain: one row per host, PID namespace and pid
-- when: raw.cpu_return, staging.foreign_endpoint
WITH thread AS (
    SELECT DISTINCT
        thread_index, host_id, pid_ns, vpid,
        dense_rank() OVER (ORDER BY host_id, pid_ns, vpid) AS process
    FROM staging.thread_presence
),
suspect AS (
    SELECT thread_index, process
    FROM thread
    WHERE process IN (SELECT process FROM staging.foreign_endpoint)
),
object AS (
    SELECT process, event_id, handle, prefix, gap_ns FROM staging.foreign_endpoint
    UNION ALL
    SELECT s.process, p.event_id, p.publisher_handle, e.prefix, e.gap_ns
    FROM raw.ros2_rcl_publisher_init AS p
    JOIN suspect AS s ON p.thread_index = s.thread_index
    ASOF JOIN staging.foreign_endpoint AS e
        ON s.process = e.process AND p.rmw_publisher_handle = e.handle AND p.event_id >= e.event_id
),
used AS (
    SELECT event_id, ts_ns, thread_index, publisher_handle AS handle FROM raw.ros2_rcl_publish
    UNION ALL
    SELECT event_id, ts_ns, thread_index, rmw_subscription_handle FROM raw.ros2_rmw_take
),
shown AS (
    SELECT process, prefix, event_id FROM staging.foreign_endpoint
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
