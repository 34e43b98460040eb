-- description: Where each process was recorded, and from when on. A session that has nothing but
--     the initialisation of the process does not count: what the process did then is not in it. A
--     process that existed before is recorded from its first event on, because the tracer tells
--     one process after the other that it begins. A process whose first events may have been lost
--     counts from the begin of the recording.
-- grain: one row per process and recording (the chunks of one trace) that it did something in
WITH recording AS (
    SELECT
        r.run_id, r.trace_id, r.recording_id,
        min(t.start_ns) OVER chunks AS begin_ns,
        max(t.end_ns) OVER chunks AS end_ns
    FROM derive.recording AS r
    JOIN store.trace AS t ON r.trace_id = t.trace_id
    WHERE t.domain IS DISTINCT FROM 'kernel'
    WINDOW chunks AS (PARTITION BY r.run_id, r.recording_id)
),
lossy AS (
    SELECT
        r.run_id, r.recording_id,
        min(l.start_ns) AS start_ns
    FROM store.gap AS l
    JOIN recording AS r ON l.trace_id = r.trace_id
    WHERE l.kind <> 'pause'
    GROUP BY r.run_id, r.recording_id
),
instance AS (
    SELECT
        run_id, process_id, trace_id,
        min(start_ns) AS first_ns,
        max(end_ns) AS last_ns
    FROM store.publication
    GROUP BY run_id, process_id, trace_id
    UNION ALL
    SELECT
        run_id, process_id, trace_id,
        min(taken_ns),
        max(taken_ns)
    FROM store.take
    GROUP BY run_id, process_id, trace_id
    UNION ALL
    SELECT
        run_id, process_id, trace_id,
        min(start_ns),
        max(greatest(start_ns, coalesce(end_ns, 0)))
    FROM store.callback_instance
    GROUP BY run_id, process_id, trace_id
),
stay AS (
    SELECT
        i.run_id, i.process_id, r.recording_id, r.begin_ns, r.end_ns,
        min(i.first_ns) AS first_ns,
        max(i.last_ns) AS last_ns
    FROM instance AS i
    JOIN recording AS r ON i.trace_id = r.trace_id
    GROUP BY i.run_id, i.process_id, r.recording_id, r.begin_ns, r.end_ns
),
creation AS (
    SELECT run_id, process_id, created_ns FROM store.node
    UNION ALL
    SELECT run_id, process_id, created_ns FROM store.publisher
    UNION ALL
    SELECT run_id, process_id, created_ns FROM store.subscription
)
SELECT
    s.run_id, s.process_id, s.recording_id, s.begin_ns, s.end_ns,
    CASE WHEN p.first_seen_ns >= s.begin_ns THEN p.first_seen_ns ELSE s.first_ns END AS first_ns,
    s.last_ns,
    -- Its first object was seen to be created before it did anything.
    coalesce(c.created_ns <= s.first_ns, false) AS is_born,
    CASE
        WHEN c.created_ns <= s.first_ns THEN s.begin_ns
        WHEN l.start_ns <= s.first_ns THEN s.begin_ns
        WHEN p.first_seen_ns >= s.begin_ns THEN p.first_seen_ns
        ELSE s.first_ns
    END AS recorded_from_ns
FROM stay AS s
JOIN store.process AS p ON s.process_id = p.process_id
ASOF LEFT JOIN creation AS c
    ON s.run_id = c.run_id AND s.process_id = c.process_id AND s.begin_ns <= c.created_ns
LEFT JOIN lossy AS l ON s.recording_id = l.recording_id
