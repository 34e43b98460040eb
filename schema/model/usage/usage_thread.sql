-- description: Threads that were sampled, and what they are here: by the ids that they have in
--     their own namespace, as events have them. What several may be is left out: containers number
--     their processes alike.
-- grain: one row per thread that was sampled and recorded events
-- when: staging.usage_line
WITH file AS (
    SELECT
        file,
        max(at_ns) AS last_ns
    FROM staging.usage_line
    GROUP BY file
),
sampled AS (
    SELECT
        file, subject,
        min(at_ns) AS first_ns,
        max(at_ns) FILTER (WHERE kind = 'gone') AS gone_ns,
        string_split(any_value(line) FILTER (WHERE kind = 'thread'), chr(9)) AS fields
    FROM staging.usage_line
    WHERE kind IN ('thread', 'gone')
    GROUP BY file, subject
),
known AS (
    SELECT
        s.file, s.subject, s.first_ns,
        coalesce(s.gone_ns, f.last_ns) AS last_ns,
        staging.usage_number(s.fields[3]) AS process,
        -- Ids in each namespace, the innermost one last.
        try_cast(string_split(s.fields[4], ' ')[-1] AS INTEGER) AS pid,
        try_cast(string_split(s.fields[5], ' ')[-1] AS INTEGER) AS tid
    FROM sampled AS s
    JOIN file AS f ON s.file = f.file
),
matched AS (
    SELECT k.file, k.subject, k.process, k.first_ns, k.last_ns, t.thread_id, t.process_id
    FROM known AS k
    JOIN staging.usage_file AS f ON k.file = f.file
    JOIN staging.host AS h
        ON f.clock_id = h.clock_id AND coalesce(f.hostname = h.hostname, true)
    JOIN staging.process AS p ON h.host_id = p.host_id AND k.pid = p.pid
    JOIN staging.thread AS t
        ON p.process_id = t.process_id
        AND k.tid = t.tid
        AND k.first_ns <= t.last_seen_ns
        AND k.last_ns >= t.first_seen_ns
    WHERE NOT p.is_ambiguous
    -- One that executes another program goes on as a thread of the same ids: the longer life
    -- counts.
    WINDOW same AS (PARTITION BY k.file, k.subject)
    QUALIFY min(h.host_id) OVER same = max(h.host_id) OVER same
        AND min(coalesce(p.pid_namespace, 0)) OVER same
        = max(coalesce(p.pid_namespace, 0)) OVER same
        AND row_number() OVER (same ORDER BY t.last_seen_ns - t.first_seen_ns DESC) = 1
)
SELECT file, subject, process, last_ns, thread_id, process_id
FROM matched
WINDOW
    earlier AS (
        PARTITION BY thread_id ORDER BY first_ns ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
    ),
    later AS (
        PARTITION BY thread_id ORDER BY first_ns ROWS BETWEEN 1 FOLLOWING AND UNBOUNDED FOLLOWING
    )
QUALIFY coalesce(first_ns >= max(last_ns) OVER earlier, true)
    AND coalesce(last_ns <= min(first_ns) OVER later, true)
