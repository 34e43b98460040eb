-- title: What had the CPUs around a moment
-- description: Programs in the second that a kernel trace or samples of the system count it in.
-- grain: one row per program
-- param: at_ns BIGINT  The moment, epoch ns
-- column: program VARCHAR  Its name
-- column: cpus DOUBLE  CPUs that it used
SELECT
    program,
    sum(cpu_ns / (end_ns - start_ns)) AS cpus
FROM main.program_cpu($runs)
WHERE start_ns <= $at_ns AND end_ns > $at_ns
GROUP BY host_id, process_id, program
HAVING cpus > 0.05
ORDER BY cpus DESC, program
LIMIT 5
