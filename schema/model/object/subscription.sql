-- name: staging.subscription
-- description: Subscriptions. A handle that messages were taken with but that was never
--     initialised in the trace gets a row without topic, as does the reader of a ring buffer.
-- grain: one row per subscription
-- when: staging.subscription_known, staging.take_origin
WITH every_subscription AS (
    SELECT
        event_id, process_id, node_id, topic_name, subscription_handle, rmw_handle, gid,
        queue_depth, created_ns, is_internal, false AS is_inferred
    FROM staging.subscription_known
    UNION ALL
    SELECT
        min(start_event_id), process_id, NULL, NULL, NULL, rmw_handle, NULL, NULL, NULL, false,
        true
    FROM staging.take_origin
    WHERE subscription_event_id IS NULL AND rmw_handle IS NOT NULL
    GROUP BY process_id, rmw_handle
    UNION ALL
    SELECT DISTINCT
        subscription_event_id, process_id, NULL, NULL, NULL, NULL::UBIGINT, NULL, NULL,
        NULL::BIGINT, false, true
    FROM staging.take_inferred
    WHERE is_inferred
)
SELECT
    row_number() OVER (ORDER BY event_id) AS subscription_id,
    process_id, node_id, topic_name, subscription_handle, rmw_handle, gid, queue_depth,
    created_ns, is_internal, is_inferred, false AS is_topic_learned,
    false AS is_topic_declared, event_id
FROM every_subscription
