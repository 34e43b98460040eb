-- name: staging.taken_apart
-- description: Which calls that were put together while they were read are taken apart again, right
--     after this (`msgflow/ingest/calls.py`): those of threads with gaps or several lives, where a
--     gap or the end of a life decides what belongs together; and those next to an event that may
--     be one more layer, behind the last or before the first.
-- grain: one row per thread, or per event that such a call ends with
WITH behind AS (
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
SELECT thread_index, NULL::BIGINT AS event_id
FROM staging.interrupted_thread
UNION ALL
SELECT NULL, event_id
FROM behind
WHERE event_id IS NOT NULL
UNION ALL
SELECT NULL, p.rmw_publish_event_id
FROM raw.whole_publication AS p
JOIN raw.ros2_rclcpp_intra_publish AS i
    ON p.rclcpp_publish_previous_call_event_id = i.event_id
