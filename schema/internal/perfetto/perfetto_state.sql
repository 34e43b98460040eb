-- description: States of threads, as the kernel recorded them, and what of that ran on which core:
--     one thread at a time.
-- grain: one row per state of a thread, and per stretch in which a thread ran on a core
WITH state AS MATERIALIZED (
    SELECT
        s.thread_id, s.state, s.start_ns, s.end_ns, s.cpu, s.priority, s.is_cpu_idle, s.waker_kind,
        p.host_id, h.hostname,
        printf('%s %d', l.label, t.tid) AS thread,
        printf('%s %d', coalesce(bl.label, o.name, '?'), coalesce(b.tid, o.tid)) AS other
    FROM main.thread_state AS s
    JOIN main.thread AS t ON s.thread_id = t.thread_id
    JOIN main.process AS p ON t.process_id = p.process_id
    JOIN main.host AS h ON p.host_id = h.host_id
    JOIN main.thread_label AS l ON s.thread_id = l.thread_id
    LEFT JOIN main.thread AS b
        ON coalesce(s.preempted_by_thread_id, s.waker_thread_id) = b.thread_id
    LEFT JOIN main.thread_label AS bl ON b.thread_id = bl.thread_id
    LEFT JOIN main.other_thread AS o
        ON coalesce(s.preempted_by_other_thread_id, s.waker_other_thread_id) = o.other_thread_id
    WHERE s.run_id = $run_id AND s.start_ns >= $start_ns AND s.start_ns < $end_ns
)
SELECT
    NULL AS host_id,
    thread_id,
    'kernel' AS track,
    'schedule' AS category,
    CASE
        WHEN is_cpu_idle THEN 'preempted, CPU idle'
        WHEN state = 'preempted' THEN concat_ws(' by ', state, other)
        ELSE state
    END AS name,
    start_ns, end_ns, cpu, priority,
    CASE WHEN waker_kind = 'thread' THEN other ELSE waker_kind END AS woken_by
FROM state
UNION ALL
SELECT
    host_id, NULL,
    printf('%s: CPU %d', hostname, cpu),
    'schedule', thread, start_ns,
    least(end_ns, lead(start_ns) OVER (PARTITION BY host_id, cpu ORDER BY start_ns)),
    cpu, priority, NULL
FROM state
WHERE state = 'running' AND cpu IS NOT NULL
ORDER BY start_ns, thread_id, host_id, cpu
