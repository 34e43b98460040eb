-- description: Samples of the processes that have events, while they had any. A sample is of the
--     innermost callback instance on its thread at its time: of those that began the last, unless
--     it was over; else the nearest one around that which was not. One that is not seen to end
--     lasts until its thread's executor goes on, or the next begins, unless a gap may hide its end.
-- grain: one row per sample of a process that recorded events
-- when: staging.stack_text
WITH RECURSIVE sample AS MATERIALIZED (
    SELECT
        row_number() OVER () AS number,
        s.tid, s.cpu, s.at_ns, s.cpu_ns, s.stack, p.process_id, t.thread_id
    FROM staging.sample_text AS s
    JOIN staging.clock AS c ON s.clock_key = c.clock_key
    JOIN staging.host AS h ON c.clock_id = h.clock_id AND coalesce(s.hostname = h.hostname, true)
    JOIN staging.process AS p
        ON h.host_id = p.host_id
        AND s.pid = p.pid
        AND s.at_ns BETWEEN p.first_seen_ns AND p.last_seen_ns
    LEFT JOIN staging.thread AS t ON p.process_id = t.process_id AND s.tid = t.tid
    -- Processes of several containers may have the same pid.
    QUALIFY count(*) OVER (PARTITION BY s.rowid) = 1
),
run AS MATERIALIZED (
    SELECT
        i.callback_instance_id, i.thread_id, i.start_ns, i.parent_id,
        coalesce(
            i.end_ns, CASE WHEN i.is_loss_affected THEN i.start_ns END, x.ts_ns, 9223372036854775807
        ) AS end_ns
    FROM staging.callback_extent AS i
    LEFT JOIN staging.executor_event AS x ON i.effective_end_event_id = x.event_id
),
around AS (
    SELECT
        s.number, r.callback_instance_id, r.parent_id, s.at_ns,
        s.at_ns >= r.end_ns AS is_over
    FROM sample AS s
    ASOF JOIN run AS r ON s.thread_id = r.thread_id AND s.at_ns >= r.start_ns
    UNION ALL
    SELECT
        a.number, r.callback_instance_id, r.parent_id, a.at_ns,
        a.at_ns >= r.end_ns
    FROM around AS a
    JOIN run AS r ON a.parent_id = r.callback_instance_id
    WHERE a.is_over
)
SELECT
    s.process_id, s.thread_id, s.tid, s.at_ns, s.cpu, a.callback_instance_id, k.stack_id, s.cpu_ns
FROM sample AS s
JOIN staging.stack_text AS x ON s.stack = x.stack
JOIN staging.stack AS k ON x.calls = k.calls
LEFT JOIN (SELECT * FROM around WHERE NOT is_over) AS a ON s.number = a.number
ORDER BY s.at_ns, s.tid
