-- title: What had the CPUs around a moment
-- description: Programs in the second that a kernel trace or samples of the system count it in.
-- grain: one row per program
-- param: at_ns BIGINT  The moment, epoch ns
-- column: program VARCHAR  Its name
-- column: cpus DOUBLE  CPUs that it used
WITH used AS (
    SELECT
        coalesce(name, '?') AS program,
        sum(running_ns) / 1e9 AS cpus
    FROM main.cpu_usage
    WHERE list_contains($runs, run_id) AND tid <> 0
        AND start_ns BETWEEN $at_ns - 999_999_999 AND $at_ns
    GROUP BY ALL
    UNION ALL
    SELECT program, cpus
    FROM main.program_use($runs)
    WHERE at_ns <= $at_ns
    QUALIFY row_number() OVER (PARTITION BY program_id ORDER BY at_ns DESC) = 1
)
SELECT program, cpus
FROM used
WHERE cpus > 0.05
ORDER BY cpus DESC, program
LIMIT 5
