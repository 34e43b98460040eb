-- name: staging.take_loss
-- description: Takes that a gap may have cut or mixed. A gap lies right before or right behind
--     their events; or one of other CPUs inside, so that the events may be of two takes; or a
--     callback is right behind the last layer of a take whose other layers are in a gap.
-- grain: one row per such take
-- when: staging.beside_gap, staging.callback_gap
WITH take AS (
    SELECT
        n.start_event_id, c.end_event_id, n.callback_start_event_id, c.thread_id,
        false AS is_callback_only
    FROM staging.take_number AS n
    JOIN staging.take_chain AS c ON n.start_event_id = c.start_event_id
    UNION ALL
    SELECT n.start_event_id, n.start_event_id, n.start_event_id, p.thread_id, true
    FROM staging.take_number AS n
    JOIN staging.callback_pair AS p ON n.start_event_id = p.start_event_id
),
elsewhere AS (
    SELECT thread_id, event_id FROM staging.callback_gap WHERE NOT is_between
)
SELECT t.start_event_id
FROM take AS t
JOIN staging.beside_gap AS g
    ON CASE WHEN g.is_behind THEN t.start_event_id ELSE t.end_event_id END = g.event_id
UNION
SELECT t.start_event_id
FROM (SELECT * FROM take WHERE thread_id IN (SELECT thread_id FROM elsewhere)) AS t
ASOF JOIN elsewhere AS g
    ON t.thread_id = g.thread_id
    AND coalesce(t.callback_start_event_id, t.end_event_id) >= g.event_id
WHERE g.event_id > t.start_event_id
UNION
SELECT t.start_event_id
FROM take AS t
JOIN staging.predecessor AS p ON t.start_event_id = p.event_id AND p.sequence = 'call'
JOIN staging.beside_gap AS g ON p.previous_event_id = g.event_id AND g.is_behind
JOIN raw.ros2_rclcpp_take AS u ON p.previous_event_id = u.event_id
WHERE t.is_callback_only
