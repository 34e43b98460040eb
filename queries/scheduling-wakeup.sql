-- title: How long woken threads waited for a CPU
-- description: The time from when a thread of a ROS process was woken to when it had a CPU
--     (docs/scheduling.md). Without the kernel's wakings there are no rows. The longest wait comes
--     first.
-- grain: one row per thread and priority
-- column: run_id, host, nodes, process
-- column: thread VARCHAR            Thread name
-- column: tid, priority
-- column: is_executor BOOLEAN       It is a thread of an executor
-- column: count BIGINT              How often it was woken in the time window
-- column: median_ns BIGINT [ns]     Median wait
-- column: p99_ns
-- column: max_ns BIGINT [ns]        Longest wait
-- column: total_ns BIGINT [ns]      Sum of the waits
-- column: meanwhile VARCHAR         Threads that had the CPU meanwhile: the three that had it
--     longest
-- column: thread_id
-- brief: nodes, max_ns, meanwhile, median_ns, p99_ns, count, thread, tid, priority, total_ns,
--     process, host
-- note: kernel
WITH waited AS (
    SELECT
        run_id, thread_id, priority,
        count(*) AS count,
        quantile_disc(end_ns - start_ns, [0.5, 0.99]) AS quantiles,
        max(end_ns - start_ns) AS max_ns,
        sum(end_ns - start_ns)::BIGINT AS total_ns
    FROM main.thread_state
    WHERE state = 'runnable'
        AND list_contains($runs, run_id)
        AND start_ns >= $start_ns
        AND start_ns < $end_ns
    GROUP BY run_id, thread_id, priority
),
taken AS (
    SELECT
        m.run_id, m.thread_id,
        m.thread_priority AS priority,
        CASE WHEN m.is_cpu_idle THEN 'idle CPU' ELSE coalesce(b.label, o.program) END AS name,
        sum(m.end_ns - m.start_ns) AS length_ns
    FROM main.preemptor AS m
    LEFT JOIN main.thread_label AS b ON m.preemptor_thread_id = b.thread_id
    LEFT JOIN main.other_thread AS o ON m.preemptor_other_thread_id = o.other_thread_id
    WHERE m.state = 'runnable'
        AND list_contains($runs, m.run_id)
        AND m.start_ns >= $start_ns
        AND m.start_ns < $end_ns
        -- A CPU that is idle for less begins to run the thread (main.withheld_cpu).
        AND (NOT m.is_cpu_idle OR m.end_ns - m.start_ns >= 1_000_000)
    GROUP BY ALL
),
meanwhile AS (
    SELECT
        run_id, thread_id, priority,
        array_to_string(list(name ORDER BY length_ns DESC, name)[:3], ', ') AS names
    FROM taken
    GROUP BY run_id, thread_id, priority
)
SELECT
    w.run_id,
    h.hostname AS host,
    l.nodes,
    p.name AS process,
    t.name AS thread,
    t.tid, w.priority,
    w.thread_id IN (SELECT thread_id FROM main.executor_thread) AS is_executor,
    w.count,
    w.quantiles[1] AS median_ns,
    w.quantiles[2] AS p99_ns,
    w.max_ns, w.total_ns,
    n.names AS meanwhile,
    w.thread_id
FROM waited AS w
JOIN main.thread AS t ON w.thread_id = t.thread_id
JOIN main.process AS p ON t.process_id = p.process_id
JOIN main.process_label AS l ON t.process_id = l.process_id
JOIN main.host AS h ON p.host_id = h.host_id
LEFT JOIN meanwhile AS n
    ON w.run_id = n.run_id
    AND w.thread_id = n.thread_id
    AND w.priority IS NOT DISTINCT FROM n.priority
ORDER BY w.run_id, w.max_ns DESC, w.thread_id, w.priority
