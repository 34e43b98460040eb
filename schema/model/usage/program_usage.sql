-- description: CPU time of processes between two looks at all of them. The first look tells
--     nothing; a process that only a later one sees began after the one before.
-- grain: one row per process that used a CPU, and time between two samples of it
-- when: staging.usage_line
WITH sample AS (
    SELECT
        file, subject, number, at_ns, before_ns,
        staging.usage_number(split_part(line, chr(9), 3)) AS ticks
    FROM staging.usage_line
    WHERE kind = 'cpu'
),
used AS (
    SELECT
        file, subject, at_ns, before_ns,
        ticks - coalesce(lag(ticks) OVER life, 0) AS ticks
    FROM sample
    WINDOW life AS (PARTITION BY file, subject ORDER BY number)
),
program AS (
    SELECT
        file, subject,
        arg_max(string_split(line, chr(9)), number) AS fields
    FROM staging.usage_line
    WHERE kind = 'process'
    GROUP BY file, subject
),
process AS (
    SELECT
        file,
        process AS subject,
        any_value(process_id) AS process_id
    FROM staging.usage_thread
    GROUP BY file, process
)
SELECT
    f.host_id, c.process_id,
    u.before_ns AS start_ns,
    u.at_ns AS end_ns,
    try_cast(p.fields[3] AS INTEGER) AS pid,
    p.fields[5] AS name,
    nullif(p.fields[6], '') AS command,
    try_cast(
        least(u.ticks * (1e9 / f.ticks), (u.at_ns - u.before_ns)::DOUBLE * f.cpus) AS BIGINT
    ) AS cpu_ns,
    -- perf is one of them where a recorder started it.
    coalesce(
        list_contains(f.recorders, p.fields[3])
        OR p.fields[5] LIKE 'lttng%'
        OR (p.fields[5] = 'perf' AND list_contains(f.recorders, p.fields[4])),
        false
    ) AS is_recorder
FROM used AS u
JOIN program AS p ON u.file = p.file AND u.subject = p.subject
JOIN staging.usage_file AS f ON u.file = f.file
LEFT JOIN process AS c ON u.file = c.file AND u.subject = c.subject
WHERE u.ticks > 0
    AND cpu_ns IS NOT NULL
    AND u.before_ns IS NOT NULL
    AND try_cast(p.fields[3] AS INTEGER) IS NOT NULL
ORDER BY f.host_id, u.at_ns, u.subject
