-- description: The number that the kernel has for each thread: what ran on the CPU at most events
--     of the thread. The number means this thread from `from_ns` on, and the next one from
--     `until_ns` on.
-- grain: one row per thread of a process life and number
-- when: staging.schedule
WITH ran AS (
    SELECT
        x.thread_id, m.tid,
        count(*) AS event_count,
        min(m.at_ns + s.shift_ns) AS first_ns,
        max(m.at_ns + s.shift_ns) AS last_ns
    FROM staging.schedule_moment AS m
    JOIN staging.schedule AS s ON m.candidate_number = s.candidate_number
    JOIN staging.thread AS x
        ON m.thread_index = x.thread_index
        AND m.event_id >= x.from_event_id
        AND m.event_id < x.until_event_id
    WHERE s.is_joined AND m.tid <> 0
    GROUP BY x.thread_id, m.tid
    QUALIFY count(*) >= 0.05 * sum(count(*)) OVER (PARTITION BY x.thread_id)
),
-- A process that was started again may have the same ids: its thread has one number after the
-- other.
pattern AS (
    SELECT r.thread_id, r.tid, r.first_ns
    FROM ran AS r
    WHERE NOT EXISTS (
        SELECT 1
        FROM ran AS o
        WHERE o.thread_id = r.thread_id
            AND o.tid <> r.tid
            AND (o.event_count, o.tid) > (r.event_count, r.tid)
            AND o.first_ns <= r.last_ns
            AND o.last_ns >= r.first_ns
    )
),
known AS (
    SELECT p.thread_id, p.tid, p.first_ns, c.clock_key
    FROM pattern AS p
    JOIN staging.thread AS t ON p.thread_id = t.thread_id
    JOIN staging.process AS o ON t.process_id = o.process_id
    JOIN staging.host AS h ON o.host_id = h.host_id
    JOIN staging.clock AS c ON h.clock_id = c.clock_id
)
SELECT
    thread_id, clock_key, tid,
    CASE WHEN row_number() OVER number = 1 THEN -4611686018427387904 ELSE first_ns END AS from_ns,
    lead(first_ns, 1, 4611686018427387904) OVER number AS until_ns
FROM known
WINDOW number AS (PARTITION BY clock_key, tid ORDER BY first_ns, thread_id)
