-- title: What threads did, as the kernel saw it
-- description: How long each thread of a ROS process was in each state, as a kernel trace shows it
--     (docs/scheduling.md). Without kernel traces there are no rows. Threads that ran longest come
--     first.
-- grain: one row per thread with known states
-- column: run_id, host, nodes, process, pid
-- column: thread VARCHAR            Thread name
-- column: tid
-- column: running_ns BIGINT [ns]    On a CPU
-- column: preempted_ns BIGINT [ns]  Ready, but the CPU was taken away
-- column: runnable_ns BIGINT [ns]   Woken, waiting for a CPU
-- column: sleeping_ns BIGINT [ns]   Waiting for something
-- column: uninterruptible_ns BIGINT [ns]  Waiting for a page or a disk
-- column: unknown_ns BIGINT [ns]    Not known, between known states
-- column: preemptions
-- column: priority INTEGER          Most urgent priority that it ran with, as the kernel has it: 0
--     to 99 real-time, 100 to 139 nice -20 to 19
-- column: loss_affected BIGINT      States during which kernel events were lost
-- column: thread_id
-- brief: nodes, thread, tid, running_ns, preempted_ns, runnable_ns, sleeping_ns, preemptions,
--     priority, uninterruptible_ns, process, pid, host
-- note: kernel
WITH state AS (
    SELECT
        run_id, thread_id, state, priority, is_loss_affected,
        -- It may go to another CPU while it waits.
        state = 'preempted'
        AND start_ns >= $start_ns
        AND lag(state) OVER (PARTITION BY thread_id ORDER BY start_ns) IS DISTINCT FROM 'preempted'
            AS is_preemption,
        least(end_ns, $end_ns) - greatest(start_ns, $start_ns) AS length_ns
    FROM main.thread_state
    WHERE list_contains($runs, run_id) AND end_ns > $start_ns AND start_ns < $end_ns
),
measured AS (
    SELECT
        run_id, thread_id,
        coalesce(sum(length_ns) FILTER (WHERE state = 'running'), 0)::BIGINT AS running_ns,
        coalesce(sum(length_ns) FILTER (WHERE state = 'preempted'), 0)::BIGINT AS preempted_ns,
        coalesce(sum(length_ns) FILTER (WHERE state = 'runnable'), 0)::BIGINT AS runnable_ns,
        coalesce(sum(length_ns) FILTER (WHERE state = 'sleeping'), 0)::BIGINT AS sleeping_ns,
        coalesce(sum(length_ns) FILTER (WHERE state = 'uninterruptible'), 0)::BIGINT
            AS uninterruptible_ns,
        coalesce(sum(length_ns) FILTER (WHERE state = 'unknown'), 0)::BIGINT AS unknown_ns,
        count(*) FILTER (WHERE is_preemption) AS preemptions,
        min(priority) AS priority,
        count(*) FILTER (WHERE is_loss_affected) AS loss_affected
    FROM state
    GROUP BY run_id, thread_id
)
SELECT
    m.run_id,
    h.hostname AS host,
    l.nodes,
    p.name AS process,
    p.pid,
    t.name AS thread,
    t.tid, m.running_ns, m.preempted_ns, m.runnable_ns, m.sleeping_ns, m.uninterruptible_ns,
    m.unknown_ns, m.preemptions, m.priority, m.loss_affected, m.thread_id
FROM measured AS m
JOIN main.thread AS t ON m.thread_id = t.thread_id
JOIN main.process AS p ON t.process_id = p.process_id
JOIN main.process_label AS l ON t.process_id = l.process_id
JOIN main.host AS h ON p.host_id = h.host_id
ORDER BY m.run_id, m.running_ns DESC, m.thread_id
