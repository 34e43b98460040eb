-- description: Processes that may have lost events while they were created: a gap other than a
--     pause lies before the first callback instance, or before the process was seen at all. If its
--     first node was seen to be created before its first callback instance, any gap counts.
-- grain: one row per process
WITH loss AS (
    SELECT
        r.recording_id,
        min(l.start_ns) AS start_ns
    FROM store.gap AS l
    JOIN derive.recording AS r ON l.trace_id = r.trace_id
    WHERE l.kind <> 'pause'
    GROUP BY r.recording_id
),
started AS (
    SELECT
        process_id,
        min(start_ns) AS start_ns
    FROM store.callback_instance
    GROUP BY process_id
),
born AS (
    SELECT
        process_id,
        min(created_ns) AS created_ns
    FROM store.node
    GROUP BY process_id
)
SELECT DISTINCT p.run_id, p.process_id
FROM derive.process_presence AS p
JOIN loss AS l ON p.recording_id = l.recording_id
LEFT JOIN started AS s ON p.process_id = s.process_id
LEFT JOIN born AS b ON p.process_id = b.process_id
WHERE b.created_ns BETWEEN p.begin_ns AND s.start_ns
    OR l.start_ns <= greatest(p.first_ns, s.start_ns)
