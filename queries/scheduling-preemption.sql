-- title: What took the CPU from which thread
-- description: How often each thread of a ROS process lost the CPU while it had work, to which
--     thread, and for how long (docs/scheduling.md). Where several threads had the CPU until it got
--     one again, each has its time. Without kernel traces there are no rows. The longest time comes
--     first.
-- grain: one row per thread, priority, and thread that took the CPU from it, with its priority
-- column: run_id, nodes, process
-- column: thread VARCHAR            Thread that lost the CPU
-- column: tid INTEGER               Its thread id
-- column: priority
-- column: preempted_by VARCHAR      Thread that had the CPU; of a ROS process its nodes, with the
--     name of the thread where that is not the one of the process
-- column: preempted_by_tid INTEGER  Its thread id; of a process without ROS the kernel's number
-- column: preempted_by_priority INTEGER  Its priority
-- column: is_ros BOOLEAN            It is of a ROS process
-- column: count BIGINT              How often it began in the time window
-- column: median_ns BIGINT [ns]     Median time for which that one had the CPU
-- column: max_ns BIGINT [ns]        Longest such time
-- column: total_ns BIGINT [ns]      Sum of these times
-- column: thread_id BIGINT          Identity of the thread that lost the CPU
-- brief: nodes, thread, preempted_by, count, total_ns, max_ns, median_ns, priority,
--     preempted_by_priority, tid, preempted_by_tid, process
-- note: kernel
WITH lost AS (
    SELECT
        run_id, thread_id,
        thread_priority AS priority,
        preemptor_thread_id AS preempted_by_thread_id,
        preemptor_other_thread_id AS preempted_by_other_thread_id,
        preemptor_priority AS preempted_by_priority,
        count(*) AS count,
        quantile_disc(end_ns - start_ns, 0.5) AS median_ns,
        max(end_ns - start_ns) AS max_ns,
        sum(end_ns - start_ns)::BIGINT AS total_ns
    FROM main.preemptor
    WHERE state = 'preempted'
        AND list_contains($runs, run_id)
        AND start_ns >= $start_ns
        AND start_ns < $end_ns
    GROUP BY ALL
)
SELECT
    l.run_id, pl.nodes,
    p.name AS process,
    t.name AS thread,
    t.tid, l.priority,
    coalesce(bl.label, o.name) AS preempted_by,
    coalesce(b.tid, o.tid) AS preempted_by_tid,
    l.preempted_by_priority,
    l.preempted_by_thread_id IS NOT NULL AS is_ros,
    l.count, l.median_ns, l.max_ns, l.total_ns, l.thread_id
FROM lost AS l
JOIN main.thread AS t ON l.thread_id = t.thread_id
JOIN main.process AS p ON t.process_id = p.process_id
JOIN main.process_label AS pl ON t.process_id = pl.process_id
LEFT JOIN main.thread AS b ON l.preempted_by_thread_id = b.thread_id
LEFT JOIN main.thread_label AS bl ON l.preempted_by_thread_id = bl.thread_id
LEFT JOIN main.other_thread AS o ON l.preempted_by_other_thread_id = o.other_thread_id
ORDER BY
    l.run_id, l.total_ns DESC, l.thread_id, l.priority, l.preempted_by_thread_id,
    l.preempted_by_other_thread_id, l.preempted_by_priority
