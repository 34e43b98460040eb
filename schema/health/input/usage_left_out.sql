-- title: Samples of the system are used in part, or not at all
-- description: What threads, programs and the machine did is known only as far as these samples
--     (usage.gz, written by msgflow record) could be read and joined to the ROS events.
-- cause: The recording was killed, or copied while it was made. Or the file is damaged, of another
--     machine or time than the traces, or not made by this msgflow.
-- cure: Where only the end is missing, nothing. Else copy the file again, or take it away; give the
--     traces of a machine the name that it has in the file: --host NAME=PATH.
-- grain: one row per file and reason
-- severity: warning
-- when: staging.usage_damage, staging.usage_file
WITH known AS (
    SELECT
        file,
        count(*) FILTER (
            WHERE kind = 'host'
                OR subject IS NOT NULL AND kind IN (
                    'process', 'cpu', 'thread', 'run', 'gone', 'cgroup', 'member', 'limit',
                    'throttled'
                )
        ) AS lines,
        count(*) FILTER (WHERE kind = 'thread') AS threads
    FROM staging.usage_line
    GROUP BY file
),
counted AS (
    SELECT
        f.recorder, f.clock_id, f.lines,
        f.lines - coalesce(k.lines, 0) AS unknown,
        CASE WHEN f.file NOT IN (SELECT file FROM staging.usage_thread) THEN k.threads END
            AS threads
    FROM staging.usage_file AS f
    LEFT JOIN known AS k ON f.file = k.file
)
SELECT
    file AS subject,
    1 AS count,
    message AS detail
FROM staging.usage_damage
UNION ALL
SELECT
    recorder, lines,
    printf('%d samples of the system are of another machine or boot than the traces', lines)
FROM counted
WHERE clock_id IS NULL
UNION ALL
SELECT
    recorder, unknown,
    printf('%d of %d samples of the system make no sense, or their times go back', unknown, lines)
FROM counted
WHERE clock_id IS NOT NULL AND unknown > 0
UNION ALL
SELECT
    recorder, threads,
    printf('none of %d threads that were sampled recorded events', threads)
FROM counted
WHERE threads > 0
