-- name: staging.take_remnant
-- description: Callbacks right behind the last layer of a take whose others are in a gap.
-- grain: one row per such begin of a callback
-- when: staging.beside_gap
SELECT p.event_id
FROM staging.predecessor AS p
JOIN staging.beside_gap AS g ON p.previous_event_id = g.event_id AND g.is_behind
JOIN raw.ros2_rclcpp_take AS u ON p.previous_event_id = u.event_id
WHERE p.sequence = 'call'
