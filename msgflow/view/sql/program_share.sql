-- description: CPU time by program and time: as samples of all processes show it, else as a kernel
--     trace does. The programs of a host that used most come one by one.
-- grain: one row per host, program and stretch of time in which it used a CPU
-- param: most BIGINT {1..20} = 7  How many programs
-- column: host
-- column: program VARCHAR  Nodes of a ROS process; the name of another one; NULL: all others
-- column: start_at, length
-- column: busy BIGINT [ns]  CPU time, the sum over CPUs
WITH used AS (
    SELECT host_id, program, start_ns, end_ns, cpu_ns
    FROM main.program_cpu([$run])
    WHERE start_ns < $end_ns AND end_ns > $start_ns
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
