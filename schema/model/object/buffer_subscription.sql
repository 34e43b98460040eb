-- name: staging.buffer_subscription
-- description: Which subscription reads an intra-process ring buffer. The buffer that a
--     transient-local publisher keeps belongs to none.
-- grain: one row per ring buffer of a subscription
-- when: raw.ros2_rclcpp_buffer_to_ipb
SELECT
    b.event_id, b.process_id, b.buffer AS buffer_handle, o.subscription_event_id
FROM staging.located('ros2_rclcpp_buffer_to_ipb') AS b
ASOF JOIN staging.located('ros2_rclcpp_ipb_to_subscription') AS i
    ON b.process_id = i.process_id AND b.ipb = i.ipb AND b.event_id <= i.event_id
JOIN staging.subscription_object AS o ON i.event_id = o.event_id
