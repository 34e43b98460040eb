-- description: How many gaps threads had seen at each begin and end of a callback, where they saw
--     any at all.
-- grain: one row per callback_start or callback_end behind the first gap of its thread
-- when: staging.near_gap WHERE sequence = 'call' AND is_between
WITH gap AS (
    SELECT
        event_id, thread_id,
        row_number() OVER (PARTITION BY thread_id ORDER BY event_id) AS segment
    FROM staging.near_gap
    WHERE sequence = 'call' AND is_between
),
event AS (
    SELECT event_id, thread_index FROM raw.ros2_callback_start
    UNION ALL
    SELECT event_id, thread_index FROM raw.ros2_callback_end
),
located AS (
    SELECT e.event_id, c.thread_id
    FROM event AS e
    JOIN staging.context AS c
        ON e.thread_index = c.thread_index
        AND e.event_id >= c.from_event_id
        AND e.event_id < c.until_event_id
    WHERE c.thread_id IN (SELECT thread_id FROM gap)
)
SELECT e.event_id, g.segment
FROM located AS e
ASOF JOIN gap AS g ON e.thread_id = g.thread_id AND e.event_id >= g.event_id
