-- title: Several executors with real-time priority share a CPU
-- description: Threads of executors with real-time priority ran on one CPU nearly all of the time.
--     While one of them runs, those of the same priority and the less urgent ones have to wait,
--     even if other CPUs are idle.
-- cause: They were bound to the same CPU (taskset, cpusets), or the machine has no other one.
-- cure: Give each of them a CPU of its own, or leave the choice to the kernel; or give them
--     priorities in the order of their deadlines, and check that all fit into the time there is.
-- grain: one row per CPU
-- severity: info
-- when: store.thread_state
WITH life AS (
    SELECT
        thread_id,
        min(start_ns) AS start_ns,
        max(end_ns) AS end_ns
    FROM main.thread_state
    GROUP BY thread_id
),
ran AS (
    SELECT
        s.run_id, s.thread_id, s.cpu,
        sum(s.end_ns - s.start_ns) AS length_ns
    FROM main.thread_state AS s
    WHERE s.state = 'running'
        AND s.priority < 100
        AND s.thread_id IN (SELECT thread_id FROM main.executor_thread)
    GROUP BY s.run_id, s.thread_id, s.cpu
),
-- A thread that may run elsewhere does so when its CPU is taken.
bound AS (
    SELECT r.run_id, r.thread_id, r.cpu, p.host_id, f.start_ns, f.end_ns
    FROM ran AS r
    JOIN life AS f ON r.thread_id = f.thread_id
    JOIN main.thread AS t ON r.thread_id = t.thread_id
    JOIN main.process AS p ON t.process_id = p.process_id
    QUALIFY r.length_ns >= 0.99 * sum(r.length_ns) OVER (PARTITION BY r.thread_id)
),
-- A process that was started again shares nothing with what it was before.
placed AS (
    SELECT a.run_id, a.thread_id, a.cpu, a.host_id
    FROM bound AS a
    SEMI JOIN bound AS b
        ON a.host_id = b.host_id
        AND a.cpu = b.cpu
        AND a.thread_id <> b.thread_id
        AND b.start_ns < a.end_ns
        AND b.end_ns > a.start_ns
)
SELECT
    a.run_id, a.host_id,
    printf('CPU %d of %s', a.cpu, h.hostname) AS subject,
    count(*) AS count,
    printf(
        '%s ran there: %s',
        derive.counted(count(*), 'thread'),
        string_agg(printf('%s %d', coalesce(t.name, '?'), t.tid), ', ' ORDER BY a.thread_id)
    ) AS detail
FROM placed AS a
JOIN main.thread AS t ON a.thread_id = t.thread_id
JOIN main.host AS h ON a.host_id = h.host_id
GROUP BY a.run_id, a.host_id, h.hostname, a.cpu
