-- description: When callbacks of services were over that answer later. Before Kilted, rclcpp
--     records no end of such a callback: none of its instances has one. Then the next executor
--     event of the thread is the end, at the latest: a thread of a multi-threaded executor may be
--     blocked before. No gap lies between.
-- grain: one row per callback instance of such a service that an executor event closes
-- when: staging.callback_run WHERE end_event_id IS NULL
WITH closed AS (
    SELECT o.start_event_id, b.callback_event_id, o.effective_end_event_id
    FROM staging.callback_run AS o
    JOIN staging.callback_binding AS b ON o.start_event_id = b.start_event_id
    WHERE b.kind = 'service' AND o.end_event_id IS NULL
),
ended AS (
    SELECT DISTINCT b.callback_event_id
    FROM staging.callback_binding AS b
    JOIN staging.callback_run AS p ON b.start_event_id = p.start_event_id
    WHERE b.callback_event_id IN (SELECT callback_event_id FROM closed)
        AND p.end_event_id IS NOT NULL
)
SELECT
    c.start_event_id,
    x.ts_ns AS end_ns
FROM closed AS c
ANTI JOIN ended AS n ON c.callback_event_id = n.callback_event_id
JOIN staging.executor_event AS x ON c.effective_end_event_id = x.event_id
ANTI JOIN (SELECT event_id FROM staging.near_gap WHERE sequence = 'executor' AND is_behind) AS g
    ON c.effective_end_event_id = g.event_id
