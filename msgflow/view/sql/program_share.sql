-- description: CPU time by program and time: as samples of all processes show it, else as a kernel
--     trace does. The programs of a host that used most come one by one.
-- grain: one row per host, program and stretch of time in which it used a CPU
-- param: most BIGINT {1..20} = 7  How many programs
-- column: host
-- column: program VARCHAR  Nodes of a ROS process; the name of another one; NULL: all others
-- column: start_at, length
-- column: busy BIGINT [ns]  CPU time, the sum over CPUs
WITH used AS (
    SELECT
        u.host_id,
        coalesce(l.nodes, u.name, '?') AS program,
        u.start_ns, u.end_ns, u.cpu_ns
    FROM main.program_usage AS u
    LEFT JOIN main.process_label AS l ON u.process_id = l.process_id
    WHERE u.run_id = $run AND u.start_ns < $end_ns AND u.end_ns > $start_ns
    UNION ALL
    SELECT
        c.host_id,
        coalesce(l.nodes, c.name, '?'),
        greatest(c.start_ns, r.start_ns),
        least(c.start_ns + 1_000_000_000, r.end_ns),
        c.running_ns
    FROM main.cpu_usage AS c
    JOIN main.run AS r ON c.run_id = r.run_id
    LEFT JOIN main.thread AS t ON c.thread_id = t.thread_id
    LEFT JOIN main.process_label AS l ON t.process_id = l.process_id
    WHERE c.run_id = $run AND c.tid <> 0
        AND c.start_ns < least($end_ns, r.end_ns) AND c.start_ns + 1_000_000_000 > $start_ns
        AND NOT EXISTS (FROM main.program_usage WHERE run_id = $run)
),
ranked AS (
    SELECT
        host_id, program,
        row_number() OVER (PARTITION BY host_id ORDER BY sum(cpu_ns) DESC, program) AS place
    FROM used
    GROUP BY host_id, program
)
SELECT
    h.hostname AS host,
    CASE WHEN r.place <= $most THEN u.program END AS program,
    u.start_ns - $origin_ns AS start_at,
    u.end_ns - u.start_ns AS length,
    sum(u.cpu_ns)::BIGINT AS busy
FROM used AS u
JOIN ranked AS r ON u.host_id = r.host_id AND u.program = r.program
JOIN main.host AS h ON u.host_id = h.host_id
GROUP BY ALL
ORDER BY host, min(r.place), start_at
