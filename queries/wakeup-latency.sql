-- name: wakeup-latency
-- title: How long woken threads waited for a CPU
-- description: The time from when a thread of a ROS process was woken to when it had a CPU
--     (docs/scheduling.md). Without the kernel's wakings there are no rows. The longest wait comes
--     first.
-- grain: one row per thread and priority
-- column: run_id BIGINT             Run
-- column: host VARCHAR [host]  Host
-- column: nodes VARCHAR             Nodes of its process; without nodes its name and id
-- column: process VARCHAR           Process name
-- column: thread VARCHAR            Thread name
-- column: tid INTEGER               Thread id
-- column: priority INTEGER          Its priority, as the kernel has it: 0 to 99 real-time, 100 to
--     139 nice -20 to 19
-- column: is_executor BOOLEAN       It is a thread of an executor
-- column: count BIGINT              How often it was woken in the time window
-- column: median_ns BIGINT [ns]     Median wait
-- column: p99_ns BIGINT [ns]        99 % of the waits are at most this
-- column: max_ns BIGINT [ns]        Longest wait
-- column: total_ns BIGINT [ns]      Sum of the waits
-- column: thread_id BIGINT          Identity of the thread
-- brief: nodes, thread, tid, median_ns, max_ns, p99_ns, count, priority, total_ns, process, host
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
)
SELECT
    w.run_id,
    h.hostname AS host,
    l.nodes,
    p.name AS process,
    t.name AS thread,
    t.tid,
    w.priority,
    w.thread_id IN (SELECT thread_id FROM main.executor_thread) AS is_executor,
    w.count,
    w.quantiles[1] AS median_ns,
    w.quantiles[2] AS p99_ns,
    w.max_ns,
    w.total_ns,
    w.thread_id
FROM waited AS w
JOIN main.thread AS t ON w.thread_id = t.thread_id
JOIN main.process AS p ON t.process_id = p.process_id
JOIN main.process_label AS l ON t.process_id = l.process_id
JOIN main.host AS h ON p.host_id = h.host_id
ORDER BY w.run_id, w.max_ns DESC, w.thread_id, w.priority
