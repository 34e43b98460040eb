-- description: CPU time of callback instances: what the kernel's scheduler shows, else the clock
--     of their thread, which the tracer of Python nodes or a performance counter has read: that
--     counts the work of the tracer, too.
-- grain: one row per callback instance whose CPU time is known
-- when: staging.callback_schedule, staging.callback_counter WHERE name = 'task_clock',
--     staging.python_mark WHERE kind = 'cpu'
WITH known AS (
    SELECT
        callback_instance_id,
        running_ns AS cpu_ns,
        'kernel' AS cpu_source,
        0 AS place
    FROM staging.callback_schedule
    WHERE unknown_ns = 0
    UNION ALL
    SELECT callback_instance_id, value, 'clock', 2
    FROM staging.callback_counter
    WHERE name = 'task_clock'
    UNION ALL
    SELECT
        n.callback_instance_id,
        try_cast(m.number AS BIGINT),
        'clock', 1
    FROM staging.python_mark AS m
    JOIN staging.callback_run AS r ON m.previous_callback_event_id = r.end_event_id
    JOIN staging.callback_number AS n ON r.start_event_id = n.start_event_id
    WHERE m.kind = 'cpu' AND m.thread_id = r.thread_id
)
SELECT callback_instance_id, cpu_ns, cpu_source
FROM known
WHERE cpu_ns IS NOT NULL
QUALIFY row_number() OVER (PARTITION BY callback_instance_id ORDER BY place, cpu_ns) = 1
