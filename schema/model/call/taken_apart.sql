-- name: staging.taken_apart
-- description: Calls that were put together while they were read, and have to be taken apart again:
--     those of threads with gaps or several lives, as what follows on what is for a gap to decide;
--     those that something else seems to belong to, before the first layer or behind the last.
--     Their events are moved to those of no whole call right after this.
-- grain: one row per call, by the event of its last layer
-- needs: staging.interrupted_thread, raw
WITH whole AS (
    SELECT
        'publication' AS call, rmw_publish_event_id AS event_id, thread_index,
        rclcpp_publish_previous_call_event_id AS previous_event_id
    FROM raw.whole_publication
    UNION ALL
    SELECT 'rcl_publication', rmw_publish_event_id, thread_index, NULL
    FROM raw.whole_rcl_publication
    UNION ALL
    SELECT 'take', rclcpp_take_event_id, thread_index, NULL FROM raw.whole_take
    UNION ALL
    SELECT 'callback', callback_end_event_id, thread_index, NULL FROM raw.whole_callback
),
behind AS (
    SELECT previous_call_event_id AS event_id FROM raw.dds_write_pre
    UNION ALL
    SELECT previous_call_event_id FROM raw.dds_write
    UNION ALL
    SELECT previous_call_event_id FROM raw.ros2_caret_dds_write
    UNION ALL
    SELECT previous_call_event_id FROM raw.ros2_caret_dds_bind_addr_to_stamp
    UNION ALL
    SELECT previous_call_event_id FROM raw.ros2_dispatch_subscription_callback
)
SELECT call, event_id
FROM whole
WHERE thread_index IN (SELECT thread_index FROM staging.interrupted_thread)
UNION
SELECT call, event_id
FROM whole
WHERE call <> 'callback' AND event_id IN (SELECT event_id FROM behind)
UNION
SELECT call, event_id
FROM whole
WHERE previous_event_id IN (SELECT event_id FROM raw.ros2_rclcpp_intra_publish)
