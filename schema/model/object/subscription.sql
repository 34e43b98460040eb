-- description: Subscriptions. A handle that messages were taken with but that was never
--     initialised in the trace gets a row without topic, as does the reader of a ring buffer.
-- grain: one row per subscription
-- when: staging.subscription_known, staging.take_number
WITH every_subscription AS (
    SELECT
        *,
        false AS is_inferred
    FROM staging.subscription_known
    UNION ALL BY NAME
    SELECT
        coalesce(subscription_event_id, min(start_event_id)) AS event_id,
        process_id, rmw_handle,
        false AS is_internal,
        true AS is_inferred,
        false AS is_agnocast
    FROM staging.take_number
    WHERE is_inferred OR (subscription_event_id IS NULL AND rmw_handle IS NOT NULL)
    GROUP BY subscription_event_id, process_id, rmw_handle
)
SELECT
    row_number() OVER (ORDER BY s.event_id) AS subscription_id,
    s.process_id, n.node_id, s.topic_name, s.subscription_handle, s.rmw_handle, s.gid,
    s.queue_depth, s.created_ns, s.is_internal, s.is_inferred,
    false AS is_topic_learned,
    false AS is_topic_declared,
    s.is_agnocast, s.event_id
FROM every_subscription AS s
LEFT JOIN staging.object_node AS n ON s.event_id = n.event_id
