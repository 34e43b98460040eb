-- description: What performance counters of its thread counted in a callback instance. A session
--     of its own may have read them, at the same event or right after it: a reading belongs to the
--     event of its kind that is nearest, and of several to one event the nearest is taken.
-- grain: one row per callback instance and counter that was read at its begin and its end
-- when: raw.reading
WITH reading AS (FROM staging.located('raw.reading')),
event AS (
    SELECT
        start_event_id, thread_id,
        callback_handle AS callback,
        'ros2:callback_start' AS event,
        start_ns AS ts_ns
    FROM staging.callback_run
    UNION ALL
    SELECT start_event_id, thread_id, callback_handle, 'ros2:callback_end', end_ns
    FROM staging.callback_run
    WHERE end_ns IS NOT NULL
),
pair AS (
    SELECT
        r.event_id, r.event, r.counter, r.value, e.start_event_id,
        r.ts_ns - e.ts_ns AS distance_ns
    FROM reading AS r
    ASOF JOIN event AS e
        ON r.thread_id = e.thread_id
        AND r.callback = e.callback
        AND r.event = e.event
        AND r.ts_ns >= e.ts_ns
    UNION ALL
    SELECT
        r.event_id, r.event, r.counter, r.value, e.start_event_id,
        e.ts_ns - r.ts_ns
    FROM reading AS r
    ASOF JOIN event AS e
        ON r.thread_id = e.thread_id
        AND r.callback = e.callback
        AND r.event = e.event
        AND r.ts_ns < e.ts_ns
),
nearest AS (
    SELECT *
    FROM pair
    QUALIFY row_number() OVER (PARTITION BY event_id, counter ORDER BY distance_ns) = 1
),
counted AS (
    SELECT
        start_event_id, counter,
        arg_min(value::HUGEINT, distance_ns) FILTER (event = 'ros2:callback_end')
        - arg_min(value, distance_ns) FILTER (event = 'ros2:callback_start') AS value
    FROM nearest
    GROUP BY start_event_id, counter
)
SELECT
    n.callback_instance_id,
    substr(c.counter, 1 + length('perf_thread_')) AS name,
    c.value
FROM counted AS c
JOIN staging.callback_number AS n ON c.start_event_id = n.start_event_id
-- What falls was no counter of one thread.
WHERE c.value BETWEEN 0 AND 9223372036854775807
