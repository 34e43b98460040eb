-- title: The tracer of a Python node turned itself off
-- description: From that moment on, the process has no events of callbacks, timers and executors:
--     what its callbacks did then is not known, and one that ran does not end.
-- cause: The detail says what went wrong in the tracer. The program ran on without it.
-- cure: Record again; if it happens again, report the sentence with the version of rclpy.
-- grain: one row per process
-- severity: warning
-- when: staging.python_mark WHERE kind = 'off'
SELECT
    m.process_id,
    count(*) AS count,
    printf(
        '%.3f s after the first event of its process: %s',
        (min(m.ts_ns) - any_value(p.first_seen_ns)) / 1e9, arg_min(m.text, m.event_id)
    ) AS detail
FROM staging.python_mark AS m
JOIN staging.process AS p ON m.process_id = p.process_id
WHERE m.kind = 'off'
GROUP BY m.process_id
