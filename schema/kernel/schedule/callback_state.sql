-- description: States of the thread during callback instances, cut to them.
-- grain: one row per callback instance that ended and state that it overlaps
-- when: staging.thread_state
WITH extent AS (
    SELECT
        thread_id,
        min(number) AS first_number
    FROM staging.thread_state
    GROUP BY thread_id
),
covered AS (
    SELECT
        i.callback_instance_id, i.start_ns, i.end_ns,
        unnest(range(coalesce(f.number, e.first_number), l.number + 1)) AS number
    FROM staging.callback_extent AS i
    JOIN extent AS e ON i.thread_id = e.thread_id
    ASOF JOIN staging.thread_state AS l ON i.thread_id = l.thread_id AND i.end_ns > l.start_ns
    ASOF LEFT JOIN staging.thread_state AS f
        ON i.thread_id = f.thread_id AND i.start_ns >= f.start_ns
    WHERE i.end_ns > i.start_ns
)
SELECT
    c.callback_instance_id,
    c.number AS state_number,
    greatest(c.start_ns, s.start_ns) AS start_ns,
    least(c.end_ns, s.end_ns) AS end_ns,
    s.start_ns > c.start_ns AS is_begin
FROM covered AS c
JOIN staging.thread_state AS s ON c.number = s.number
WHERE s.end_ns > c.start_ns
