-- title: CPU time by thread, of all processes
-- description: How long each thread had a CPU in the seconds of the time window, as a kernel trace
--     shows it (docs/scheduling.md), threads of processes without ROS included. The idle threads
--     of the CPUs are left out. Without kernel traces there are no rows. Threads that ran longest
--     come first.
-- grain: one row per host and thread
-- column: run_id, host
-- column: nodes VARCHAR             First two nodes of its process, and how many more; without
--     nodes its name and id; NULL: a process without ROS
-- column: process VARCHAR           Process name; NULL: a process without ROS
-- column: pid
-- column: thread VARCHAR            Thread name
-- column: tid INTEGER               Thread id; of a process without ROS the kernel's number
-- column: running_ns BIGINT [ns]    How long it had a CPU
-- column: share DOUBLE [share]      That divided by the time for which one CPU was traced
-- column: most_share DOUBLE [share]  The largest share of a CPU in one second
-- column: cpus BIGINT               CPUs that it ran on
-- column: frequency_hz DOUBLE [Hz]  Mean frequency of its CPUs in the seconds in which it ran, by
--     its time there; NULL: not recorded
-- column: thread_id
-- brief: nodes, thread, tid, share, running_ns, most_share, cpus, process, pid, frequency_hz, host
-- note: kernel
WITH chosen AS (
    SELECT *
    FROM main.cpu_usage
    WHERE list_contains($runs, run_id) AND start_ns >= $start_ns AND start_ns < $end_ns
),
traced AS (
    SELECT
        run_id, host_id,
        max(length_ns) AS length_ns
    FROM (
        SELECT
            run_id, host_id, cpu,
            sum(running_ns) AS length_ns
        FROM chosen
        GROUP BY ALL
    )
    GROUP BY run_id, host_id
),
second AS (
    SELECT
        run_id, host_id, thread_id,
        CASE WHEN thread_id IS NULL THEN tid END AS other_tid,
        name, start_ns,
        sum(running_ns) AS running_ns,
        list(DISTINCT cpu) AS cpus,
        sum(running_ns) FILTER (WHERE frequency_hz IS NOT NULL) AS measured_ns,
        sum(running_ns * frequency_hz::DOUBLE) AS cycles
    FROM chosen
    WHERE tid <> 0
    GROUP BY ALL
),
measured AS (
    SELECT
        run_id, host_id, thread_id, other_tid,
        any_value(name) AS name,
        sum(running_ns)::BIGINT AS running_ns,
        max(running_ns) / 1e9 AS most_share,
        len(list_distinct(flatten(list(cpus)))) AS cpus,
        sum(cycles) / sum(measured_ns) AS frequency_hz
    FROM second
    GROUP BY run_id, host_id, thread_id, other_tid
)
SELECT
    m.run_id,
    h.hostname AS host,
    l.nodes,
    p.name AS process,
    p.pid,
    coalesce(t.name, m.name) AS thread,
    coalesce(t.tid, m.other_tid) AS tid,
    m.running_ns,
    m.running_ns / c.length_ns AS share,
    m.most_share, m.cpus, m.frequency_hz, m.thread_id
FROM measured AS m
JOIN traced AS c ON m.run_id = c.run_id AND m.host_id = c.host_id
JOIN main.host AS h ON m.host_id = h.host_id
LEFT JOIN main.thread AS t ON m.thread_id = t.thread_id
LEFT JOIN main.process AS p ON t.process_id = p.process_id
LEFT JOIN main.process_label AS l ON t.process_id = l.process_id
ORDER BY m.run_id, m.running_ns DESC, m.host_id, tid, m.thread_id
