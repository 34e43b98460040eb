-- description: How long quotas of CPU time held up the processes in them, between two samples. The
--     kernel counts in microseconds or, in older groups, in nanoseconds.
-- grain: one row per quota, process in it, and time between two samples in which it held threads up
-- when: staging.usage_thread
WITH sample AS (
    SELECT
        file, subject, number, at_ns, before_ns,
        staging.usage_number(regexp_extract(line, '\bnr_throttled (\d+)', 1)) AS throttled_count,
        coalesce(
            staging.usage_number(regexp_extract(line, '\bthrottled_time (\d+)', 1)),
            staging.usage_number(regexp_extract(line, '\bthrottled_usec (\d+)', 1) || '000')
        ) AS throttled_ns
    FROM staging.usage_line
    WHERE kind = 'throttled'
),
used AS (
    SELECT
        file, subject, number, at_ns, before_ns,
        throttled_count - lag(throttled_count) OVER life AS throttled_count,
        throttled_ns - lag(throttled_ns) OVER life AS throttled_ns
    FROM sample
    WINDOW life AS (PARTITION BY file, subject ORDER BY number)
),
-- A quota is some time in each period.
quota AS (
    SELECT
        file, subject, number,
        staging.usage_number(regexp_extract(line, '\t(\d+) \d+$', 1))
        / nullif(staging.usage_number(regexp_extract(line, '\d+$')), 0) AS cpus
    FROM staging.usage_line
    WHERE kind = 'limit'
),
cgroup AS (
    SELECT
        file, subject,
        any_value(split_part(line, chr(9), 3)) AS name
    FROM staging.usage_line
    WHERE kind = 'cgroup'
    GROUP BY file, subject
),
member AS (
    SELECT DISTINCT
        l.file,
        staging.usage_number(split_part(l.line, chr(9), 3)) AS subject,
        t.process_id
    FROM staging.usage_line AS l
    JOIN staging.usage_thread AS t ON l.file = t.file AND l.subject = t.process
    WHERE l.kind = 'member'
)
SELECT
    f.host_id, m.process_id, g.name,
    u.before_ns AS start_ns,
    u.at_ns AS end_ns,
    u.throttled_count, u.throttled_ns, q.cpus
FROM used AS u
JOIN member AS m ON u.file = m.file AND u.subject = m.subject
JOIN cgroup AS g ON u.file = g.file AND u.subject = g.subject
JOIN staging.usage_file AS f ON u.file = f.file
ASOF LEFT JOIN quota AS q ON u.file = q.file AND u.subject = q.subject AND u.number >= q.number
WHERE u.throttled_count >= 0
    AND u.throttled_ns >= 0
    AND u.throttled_count + u.throttled_ns > 0
    AND u.before_ns IS NOT NULL
ORDER BY f.host_id, u.at_ns, m.process_id
