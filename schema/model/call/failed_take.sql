-- description: Attempts to take from a subscription that took nothing.
-- grain: one row per rmw_take without a message
-- when: raw.ros2_rmw_take
WITH failed AS (
    SELECT event_id, ts_ns, trace_index, thread_id, process_id, rmw_subscription_handle
    FROM staging.located('raw.ros2_rmw_take')
    WHERE taken = 0
)
SELECT
    f.trace_index + 1 AS trace_id,
    s.subscription_id, f.process_id, f.thread_id,
    f.ts_ns AS failed_ns
FROM failed AS f
ASOF JOIN staging.subscription_known AS k
    ON f.process_id = k.process_id
    AND f.rmw_subscription_handle = k.rmw_handle
    AND f.event_id >= k.event_id
JOIN staging.subscription AS s ON k.event_id = s.event_id
