-- description: CPU use of programs over time, as msgflow record samples it once a second: those
--     that use more than a fifth of a CPU in some sample, without what makes the recording.
--     Processes without ROS that have one command are one program.
-- grain: one row per program and sample of its machine
-- param: runs
-- column: run_id
-- column: host_id BIGINT  Machine
-- column: process_id BIGINT  Its process; NULL: it is without ROS
-- column: program_id BIGINT  Its identity: the process_id, below 0 for one without ROS
-- column: program VARCHAR  The begin of its command line, without directories
-- column: processes BIGINT  How many it has, in all samples
-- column: at_ns BIGINT [epoch ns]  Begin of the time that was sampled
-- column: cpus DOUBLE  CPUs that they used meanwhile
CREATE OR REPLACE MACRO main.program_use(runs) AS TABLE
WITH used AS (
    SELECT
        run_id, host_id, process_id, pid, start_ns, is_recorder,
        coalesce(left(regexp_replace(command, '(^| )[^ ]*/', '\1', 'g'), 40), name) AS program,
        cpu_ns / (end_ns - start_ns) AS used_cpus
    FROM main.program_usage
    WHERE list_contains(runs, run_id)
),
program AS (
    SELECT
        run_id, host_id, process_id, program,
        coalesce(
            process_id, -row_number() OVER (ORDER BY run_id, host_id, program, process_id)
        ) AS program_id,
        count(DISTINCT pid) AS processes
    FROM used
    WHERE NOT is_recorder
    GROUP BY run_id, host_id, process_id, program
)
SELECT
    p.run_id, p.host_id, p.process_id, p.program_id, p.program, p.processes,
    s.start_ns AS at_ns,
    coalesce(sum(u.used_cpus), 0) AS cpus
FROM program AS p
-- A program that used no CPU has no row of its own.
JOIN (SELECT DISTINCT run_id, host_id, start_ns FROM used) AS s
    ON p.run_id = s.run_id AND p.host_id = s.host_id
LEFT JOIN used AS u
    ON p.run_id = u.run_id AND p.host_id = u.host_id AND p.program = u.program
    AND p.process_id IS NOT DISTINCT FROM u.process_id
    AND s.start_ns = u.start_ns
GROUP BY
    p.run_id, p.host_id, p.process_id, p.program_id, p.program, p.processes, s.start_ns
QUALIFY max(cpus) OVER (PARTITION BY p.program_id) > 0.2
