-- description: Publishers and subscriptions of ids under which objects of several processes were
--     made: all GIDs that Fast DDS gives to a process begin with the same eight bytes, two of them
--     random. `gap_ns`: begin of the first gap behind it.
-- grain: one row per initialisation of such an object
-- when: raw.ros2_rmw_publisher_init, raw.ros2_rmw_subscription_init
WITH thread AS (
    SELECT DISTINCT
        thread_index, host_id, pid_ns, vpid,
        dense_rank() OVER (ORDER BY host_id, pid_ns, vpid) AS process
    FROM staging.thread_presence
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
)
SELECT i.process, i.event_id, i.handle, i.prefix, min(g.start_ns) AS gap_ns
FROM identified AS i
JOIN staging.placed_source AS r ON i.trace_index = r.trace_index
LEFT JOIN staging.gap AS g ON r.recording_index = g.recording_index AND i.ts_ns < g.covered_until_ns
GROUP BY ALL
