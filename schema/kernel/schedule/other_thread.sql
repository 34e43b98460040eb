-- description: Threads that are none of a ROS process, but had the CPU while one that is waited
--     for it, or woke it. The kernel's idle thread of each CPU is one of them.
-- grain: one row per host, tid and name
-- when: staging.schedule_interval
WITH seen AS (
    SELECT
        clock_key, tid, name,
        start_ns AS at_ns
    FROM staging.cpu_taken
    UNION ALL
    SELECT w.clock_key, w.waker_tid, w.waker_name, w.at_ns
    FROM staging.thread_waking AS w
    WHERE w.waker_tid IS NOT NULL
        AND w.event_id IN (SELECT waking_event_id FROM staging.schedule_interval)
),
host AS (
    SELECT
        s.clock_key,
        min(t.host_id) AS host_id
    FROM staging.schedule AS s
    JOIN staging.trace AS t ON s.trace_index + 1 = t.trace_id
    WHERE s.is_joined
    GROUP BY s.clock_key
)
SELECT
    row_number() OVER (ORDER BY h.host_id, o.tid, o.name) AS other_thread_id,
    h.host_id, o.tid, o.name, o.clock_key
FROM (
    SELECT DISTINCT o.clock_key, o.tid, o.name
    FROM seen AS o
    LEFT JOIN staging.thread_tid AS t ON staging.has_tid(t, o.clock_key, o.tid, o.at_ns)
    WHERE t.thread_id IS NULL
) AS o
JOIN host AS h ON o.clock_key = h.clock_key
