-- description: When the garbage collector of Python ran, with the callback instance that it
--     interrupted. The tracer of Python nodes says at its end how long it took.
-- grain: one row per garbage collection
-- when: staging.python_mark WHERE kind = 'collect'
WITH mark AS MATERIALIZED (FROM staging.python_mark WHERE kind = 'collect')
SELECT
    m.process_id, m.thread_id,
    m.ts_ns - try_cast(m.number AS BIGINT) AS start_ns,
    m.ts_ns AS end_ns,
    try_cast(m.text AS INTEGER) AS generation,
    n.callback_instance_id
FROM mark AS m
JOIN staging.process AS p ON m.process_id = p.process_id
LEFT JOIN staging.innermost_run('mark') AS r ON m.event_id = r.event_id
LEFT JOIN staging.callback_number AS n ON r.start_event_id = n.start_event_id
-- No collection is longer than its process.
WHERE try_cast(m.number AS BIGINT) <= m.ts_ns - p.first_seen_ns
