-- title: Who took the CPU from whom
-- description: Which programs had the CPU for which threads of a ROS process waited, how often and
--     for how long (docs/scheduling.md). Where several had it until the thread got one again, each
--     has its time. Without kernel traces there are no rows. The longest time comes first; what
--     records comes last: without it, it does not run.
-- grain: one row per process, priority of its threads, and program that had their CPU, or reason
--     for which it was idle
-- column: run_id, nodes, process
-- column: threads BIGINT            Its threads that lost the CPU
-- column: priority
-- column: preempted_by VARCHAR      What had the CPU: nodes of a ROS process, the program of
--     another one, or 'idle CPU', with what the numbers fit: 'quota', 'real_time_limit' or
--     'unused_cpu' (main.withheld_cpu)
-- column: preempted_by_pid INTEGER  Its process; NULL: several, or not known
-- column: command VARCHAR           File that it executed; NULL: not known
-- column: preempted_by_threads BIGINT  How many of its threads had the CPU
-- column: preempted_by_priority INTEGER  The most urgent priority of these
-- column: is_ros BOOLEAN            It is a ROS process
-- column: is_recorder BOOLEAN       It records
-- column: count BIGINT              How often it began in the time window
-- column: median_ns BIGINT [ns]     Median time for which it had the CPU
-- column: max_ns BIGINT [ns]        Longest such time
-- column: total_ns BIGINT [ns]      Sum of these times
-- column: woken_ns BIGINT [ns]      Sum of the times for which it had the CPU while threads, woken,
--     waited for one
-- column: all_nodes VARCHAR[] [node]  All nodes of the process that lost the CPU
-- column: process_id BIGINT         Identity of the process that lost the CPU
-- brief: nodes, preempted_by, preempted_by_pid, total_ns, woken_ns, count, max_ns,
--     preempted_by_priority, priority, median_ns, preempted_by_threads, command, threads, process
-- note: kernel
WITH lost AS (
    SELECT
        p.run_id, t.process_id, p.thread_id, p.thread_priority, p.state, p.preemptor_priority,
        p.end_ns - p.start_ns AS length_ns,
        coalesce(b.process_id, o.process_id) AS by_process_id,
        coalesce(p.preemptor_thread_id, -p.preemptor_other_thread_id) AS by_thread,
        CASE
            WHEN p.is_cpu_idle THEN concat_ws(', ', 'idle CPU', w.reason)
            ELSE coalesce(l.nodes, o.program)
        END AS preempted_by,
        coalesce(r.pid, o.pid, CASE WHEN NOT p.is_cpu_idle THEN o.tid END) AS by_pid,
        o.command,
        coalesce(o.is_recorder, false) AS is_recorder
    FROM main.preemptor AS p
    JOIN main.thread AS t ON p.thread_id = t.thread_id
    LEFT JOIN main.thread AS b ON p.preemptor_thread_id = b.thread_id
    LEFT JOIN main.other_thread AS o ON p.preemptor_other_thread_id = o.other_thread_id
    LEFT JOIN main.process AS r ON coalesce(b.process_id, o.process_id) = r.process_id
    LEFT JOIN main.process_label AS l ON r.process_id = l.process_id
    LEFT JOIN main.withheld_cpu AS w ON p.thread_id = w.thread_id AND p.start_ns = w.start_ns
    WHERE list_contains($runs, p.run_id)
        AND p.start_ns >= $start_ns
        AND p.start_ns < $end_ns
        -- A CPU that is idle for less begins to run the thread.
        AND (NOT p.is_cpu_idle OR w.thread_id IS NOT NULL)
),
measured AS (
    SELECT
        run_id, process_id,
        thread_priority AS priority,
        preempted_by, by_process_id, is_recorder,
        count(DISTINCT thread_id) AS threads,
        CASE WHEN count(DISTINCT by_pid) = 1 THEN any_value(by_pid) END AS preempted_by_pid,
        CASE WHEN count(DISTINCT command) = 1 THEN any_value(command) END AS command,
        count(DISTINCT by_thread) AS preempted_by_threads,
        min(preemptor_priority) AS preempted_by_priority,
        count(*) FILTER (WHERE state = 'preempted') AS count,
        quantile_disc(length_ns, 0.5) FILTER (WHERE state = 'preempted') AS median_ns,
        max(length_ns) FILTER (WHERE state = 'preempted') AS max_ns,
        coalesce(sum(length_ns) FILTER (WHERE state = 'preempted'), 0)::BIGINT AS total_ns,
        coalesce(sum(length_ns) FILTER (WHERE state = 'runnable'), 0)::BIGINT AS woken_ns
    FROM lost
    GROUP BY run_id, process_id, thread_priority, preempted_by, by_process_id, is_recorder
)
SELECT
    m.run_id, l.nodes,
    p.name AS process,
    m.threads, m.priority, m.preempted_by, m.preempted_by_pid, m.command, m.preempted_by_threads,
    m.preempted_by_priority,
    m.by_process_id IS NOT NULL AS is_ros,
    m.is_recorder, m.count, m.median_ns, m.max_ns, m.total_ns, m.woken_ns, l.all_nodes, m.process_id
FROM measured AS m
JOIN main.process AS p ON m.process_id = p.process_id
JOIN main.process_label AS l ON m.process_id = l.process_id
ORDER BY
    m.run_id, m.is_recorder, m.total_ns + m.woken_ns DESC, m.process_id, m.priority,
    m.preempted_by, m.by_process_id
