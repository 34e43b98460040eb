-- description: What threads did between two samples. A sample that is not there says that nothing
--     has changed. The wait for a CPU is counted when it ends: one that is longer than the time
--     since the look before began earlier, and then all since the last change is one row. Counters
--     that fall are of no use.
-- grain: one row per thread and time between two samples of it
-- when: staging.usage_thread
WITH sample AS (
    SELECT
        l.file, l.subject, l.number, l.before_ns, t.thread_id, t.last_ns,
        string_split(l.line, chr(9)) AS fields,
        l.at_ns + coalesce(staging.usage_number(fields[3]), 0) AS at_ns,
        fields[4] AS state,
        -- Times on a CPU and without one, page faults of both kinds, waits for a disk, switches of
        -- both kinds.
        list_transform(fields[5:11], lambda word: staging.usage_number(word)) AS counts
    FROM staging.usage_line AS l
    JOIN staging.usage_thread AS t ON l.file = t.file AND l.subject = t.subject
    WHERE l.kind = 'run'
),
changed AS (
    SELECT
        file, subject, number, before_ns, thread_id, last_ns, at_ns, state, counts,
        lag(state) OVER life AS state_before
    FROM sample
    WINDOW life AS (PARTITION BY file, subject ORDER BY number)
    QUALIFY counts[:2] IS DISTINCT FROM lag(counts[:2]) OVER life
),
counted AS (
    SELECT
        thread_id, before_ns, at_ns, state, state_before, counts,
        lag(at_ns) OVER life AS since_ns,
        lag(counts) OVER life AS earlier
    FROM changed
    WINDOW life AS (PARTITION BY file, subject ORDER BY number)
),
used AS (
    SELECT
        thread_id, since_ns, at_ns, state, state_before,
        counts[1] - earlier[1] AS running_ns,
        counts[2] - earlier[2] AS waiting_ns,
        counts[3] - earlier[3] AS minor_faults,
        counts[4] - earlier[4] AS major_faults,
        try_cast((counts[5] - earlier[5]) * 1e7 AS BIGINT) AS io_ns,
        counts[6] - earlier[6] AS voluntary_switches,
        counts[7] - earlier[7] AS forced_switches,
        CASE
            WHEN running_ns + waiting_ns > at_ns - before_ns THEN since_ns
            ELSE greatest(before_ns, since_ns)
        END AS start_ns
    FROM counted
),
piece AS (
    SELECT
        thread_id, start_ns,
        at_ns AS end_ns,
        least(running_ns, end_ns - start_ns) AS running_ns,
        least(waiting_ns, end_ns - start_ns - least(running_ns, end_ns - start_ns)) AS waiting_ns,
        state, minor_faults, major_faults, io_ns, voluntary_switches, forced_switches
    FROM used
    WHERE running_ns >= 0 AND waiting_ns >= 0
    UNION ALL
    SELECT thread_id, since_ns, start_ns, 0, 0, state_before, 0, 0, 0, 0, 0
    FROM used
    UNION ALL
    SELECT
        thread_id,
        max(at_ns),
        any_value(last_ns),
        0, 0,
        arg_max(state, number),
        0, 0, 0, 0, 0
    FROM sample
    GROUP BY file, subject, thread_id
)
SELECT
    thread_id, start_ns, end_ns, running_ns, waiting_ns, state, minor_faults, major_faults, io_ns,
    voluntary_switches, forced_switches
FROM piece
WHERE end_ns > start_ns
ORDER BY thread_id, start_ns
