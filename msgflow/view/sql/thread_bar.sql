-- description: What the kernel did with threads, as bars of the timeline: the states of each thread,
--     and on each core what ran there, and who lost it to whom. Of other processes nothing but what
--     took a core from a thread of a ROS process is known.
-- grain: one row per bar
-- kind: inline
-- column: run_id
-- column: row_key BIGINT  Row of the timeline, see row.sql
-- column: kind UTINYINT  13 running, 14 preempted, 15 runnable, 16 sleeping, 17 uninterruptible,
--     18 unknown
-- column: id BIGINT  Of a thread what took its CPU, or woke it; of a core what ran there, or took
--     it: see thread_name.sql. -1: not known, or the state needs none; -2: nothing, the CPU is idle
-- column: start_ns, end_ns
-- column: flags UTINYINT  1: kernel events were lost; what woke it: 16 timer, 32 interrupt,
--     48 softirq, neither: a thread
SELECT
    run_id,
    -4 * thread_id - 2 AS row_key,
    CASE state
        WHEN 'running' THEN 13
        WHEN 'preempted' THEN 14
        WHEN 'runnable' THEN 15
        WHEN 'sleeping' THEN 16
        WHEN 'uninterruptible' THEN 17
        ELSE 18
    END::UTINYINT AS kind,
    coalesce(
        2 * preempted_by_thread_id, 2 * preempted_by_other_thread_id + 1,
        CASE WHEN is_cpu_idle THEN -2 END,
        CASE WHEN waker_kind = 'thread'
            THEN coalesce(2 * waker_thread_id, 2 * waker_other_thread_id + 1) END,
        -1
    ) AS id,
    start_ns, end_ns,
    (is_loss_affected::UTINYINT + CASE waker_kind
        WHEN 'timer' THEN 16
        WHEN 'interrupt' THEN 32
        WHEN 'softirq' THEN 48
        ELSE 0
    END)::UTINYINT AS flags
FROM main.thread_state
UNION ALL
SELECT
    s.run_id,
    -4 * (8192 * p.host_id + s.cpu) - 3,
    CASE s.state WHEN 'running' THEN 13 ELSE 14 END,
    CASE
        WHEN s.state = 'running' THEN 2 * s.thread_id
        WHEN s.is_cpu_idle THEN -2
        ELSE coalesce(2 * s.preempted_by_thread_id, 2 * s.preempted_by_other_thread_id + 1, -1)
    END,
    s.start_ns, s.end_ns,
    s.is_loss_affected::UTINYINT
FROM main.thread_state AS s
JOIN main.thread AS t ON s.thread_id = t.thread_id
JOIN main.process AS p ON t.process_id = p.process_id
WHERE s.state IN ('running', 'preempted') AND s.cpu IS NOT NULL
