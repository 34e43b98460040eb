-- description: Subscriptions whose rcl initialisation was traced, with rmw handle and GID.
-- grain: one row per rcl_subscription_init
-- when: raw.ros2_rcl_subscription_init
WITH rmw_init AS (
    SELECT
        event_id, ts_ns, process_id, rmw_subscription_handle,
        staging.gid_bytes(gid) AS gid
    FROM staging.located('raw.ros2_rmw_subscription_init')
)
SELECT
    s.event_id, s.process_id, s.thread_id, s.topic_name, s.subscription_handle,
    nullif(s.rmw_subscription_handle, 0) AS rmw_handle,
    r.gid, s.queue_depth,
    least(s.ts_ns, r.ts_ns) AS created_ns,
    staging.is_internal_topic(s.topic_name) AS is_internal,
    coalesce(s.rmw_subscription_handle = 0, false) AS is_agnocast
FROM staging.located('raw.ros2_rcl_subscription_init') AS s
ASOF LEFT JOIN rmw_init AS r
    ON s.process_id = r.process_id
    AND s.rmw_subscription_handle = r.rmw_subscription_handle
    AND s.event_id >= r.event_id
