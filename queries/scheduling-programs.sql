-- title: CPU time by program
-- description: CPU time of all processes of a host, those without ROS included, as msgflow record
--     samples it once a second (docs/record.md): no kernel trace is needed. Samples that begin in
--     the time window count. Without samples there are no rows. The process that used most comes
--     first.
-- grain: one row per process
-- column: run_id, host
-- column: nodes VARCHAR             First two nodes of the process, and how many more; without
--     nodes its name and id; NULL: a process without ROS
-- column: program VARCHAR           Name of the process
-- column: pid INTEGER               Process id, as msgflow record saw it
-- column: cpus DOUBLE               CPUs that it used: its CPU time divided by the time sampled
-- column: most_cpus DOUBLE          The most that it used in a second
-- column: cpu_ns BIGINT [ns]        Its CPU time
-- column: command VARCHAR           The begin of its command line
-- column: is_recorder BOOLEAN       It makes the recording: msgflow, LTTng or perf
-- column: process_id BIGINT         Identity of the process; NULL: one without ROS events
-- brief: program, cpus, most_cpus, nodes, command, pid, cpu_ns, is_recorder, host
-- note: usage
WITH sampled AS (
    SELECT
        host_id,
        sum(end_ns - start_ns) AS length_ns
    FROM main.host_usage
    WHERE list_contains($runs, run_id) AND start_ns >= $start_ns AND start_ns < $end_ns
    GROUP BY host_id
),
used AS (
    SELECT
        run_id, host_id, process_id, pid, name, command, is_recorder,
        sum(cpu_ns)::BIGINT AS cpu_ns,
        max(cpu_ns / (end_ns - start_ns)::DOUBLE) AS most_cpus
    FROM main.program_usage
    WHERE list_contains($runs, run_id) AND start_ns >= $start_ns AND start_ns < $end_ns
    GROUP BY ALL
)
SELECT
    u.run_id,
    h.hostname AS host,
    l.nodes,
    u.name AS program,
    u.pid,
    u.cpu_ns / s.length_ns::DOUBLE AS cpus,
    u.most_cpus, u.cpu_ns, u.command, u.is_recorder, u.process_id
FROM used AS u
JOIN sampled AS s ON u.host_id = s.host_id
JOIN main.host AS h ON u.host_id = h.host_id
LEFT JOIN main.process_label AS l ON u.process_id = l.process_id
ORDER BY u.run_id, cpus DESC, u.host_id, u.pid, u.name, u.command
