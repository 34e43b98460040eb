-- description: CPU time of programs: as samples of all processes show it, else second by second, as
--     a kernel trace does.
-- grain: one row per program, or thread and CPU, and stretch of time in which it used a CPU
-- param: runs
-- column: run_id
-- column: host_id BIGINT  Machine or container
-- column: process_id BIGINT  The process; NULL: one without ROS
-- column: program VARCHAR  Nodes of a ROS process; the name of another one
-- column: start_ns, end_ns
-- column: cpu_ns BIGINT [ns]  CPU time
CREATE OR REPLACE MACRO main.program_cpu(runs) AS TABLE
SELECT
    u.run_id, u.host_id, u.process_id,
    coalesce(l.nodes, u.name, '?') AS program,
    u.start_ns, u.end_ns, u.cpu_ns
FROM main.program_usage AS u
LEFT JOIN main.process_label AS l ON u.process_id = l.process_id
WHERE list_contains(runs, u.run_id)
UNION ALL
SELECT
    c.run_id, c.host_id, t.process_id,
    coalesce(l.nodes, c.name, '?'),
    greatest(c.start_ns, r.start_ns),
    least(c.start_ns + 1_000_000_000, r.end_ns),
    c.running_ns
FROM main.cpu_usage AS c
JOIN main.run AS r ON c.run_id = r.run_id
LEFT JOIN main.thread AS t ON c.thread_id = t.thread_id
LEFT JOIN main.process_label AS l ON t.process_id = l.process_id
WHERE list_contains(runs, c.run_id)
    AND c.tid <> 0
    AND c.start_ns < r.end_ns
    AND c.start_ns + 1_000_000_000 > r.start_ns
    AND c.run_id NOT IN (SELECT run_id FROM main.program_usage)
