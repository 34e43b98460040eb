-- description: What ran on the CPU for which a thread waited, one thread after the other. What the
--     next switch contradicts is not known. The other thread ran from `start_ns` to `end_ns`; its
--     number is 0 while the CPU was idle.
-- grain: one row per wait for a CPU and stretch of time in which another thread had it
-- when: staging.cpu_wait
WITH wait AS (
    SELECT w.*, s.clock_key, s.shift_ns
    FROM staging.cpu_wait AS w
    JOIN staging.schedule AS s ON w.trace_index = s.trace_index
),
-- All switches are sorted, with few and narrow columns, once for both ends of the waits.
extent AS (
    SELECT
        w.number,
        min(r.switch_number) AS first_number,
        max(r.switch_number) AS last_number
    FROM (
        SELECT
            number, trace_index, cpu,
            unnest([start_ns - shift_ns, end_ns - shift_ns - 1]) AS at_ns
        FROM wait
    ) AS w
    ASOF JOIN (SELECT trace_index, cpu_id, ts_ns, switch_number FROM raw.sched_switch) AS r
        ON w.trace_index = r.trace_index AND w.cpu = r.cpu_id AND w.at_ns >= r.ts_ns
    GROUP BY w.number
    HAVING count(*) = 2
),
run AS (
    SELECT
        number,
        unnest(range(first_number, last_number + 1)) AS switch_number
    FROM extent
)
SELECT
    w.thread_id, w.state_start_ns,
    w.start_ns AS wait_start_ns,
    greatest(w.start_ns, r.ts_ns + w.shift_ns) AS start_ns,
    least(w.end_ns, coalesce(e.ts_ns + w.shift_ns, w.end_ns)) AS end_ns,
    w.state, w.cpu, w.clock_key,
    r.next_tid AS tid,
    r.next_comm AS name,
    r.next_prio + CASE WHEN o.tracer LIKE 'perf%' THEN 0 ELSE 100 END AS priority,
    w.priority AS thread_priority
FROM run AS n
JOIN wait AS w ON n.number = w.number
JOIN raw.sched_switch AS r
    ON w.trace_index = r.trace_index AND w.cpu = r.cpu_id AND n.switch_number = r.switch_number
JOIN staging.source AS o ON w.trace_index = o.trace_index
LEFT JOIN raw.sched_switch AS e
    ON w.trace_index = e.trace_index AND w.cpu = e.cpu_id AND n.switch_number + 1 = e.switch_number
WHERE r.next_tid <> w.tid AND (e.event_id IS NULL OR e.run_start_ns IS NOT NULL)
