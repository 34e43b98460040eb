-- kind: inline
-- description: Takes, numbered in the order in which they began, with their subscription.
-- grain: one row per message handed over to a subscription

-- Of the callback instances, only those that were handed a message without a take have a number.
WITH every_take AS NOT MATERIALIZED (
    SELECT
        start_event_id, end_event_id, trace_index, process_id, thread_id, taken_ns,
        source_timestamp_ns, method
    FROM staging.take_chain
    UNION ALL
    SELECT
        start_event_id, start_event_id, trace_index, process_id, thread_id, start_ns, NULL,
        'callback_only'
    FROM staging.callback_run
)
SELECT
    s.take_id,
    t.trace_index + 1 AS trace_id,
    s.subscription_id, t.process_id, t.thread_id, t.taken_ns, t.source_timestamp_ns, t.method,
    t.start_event_id, t.end_event_id, s.callback_start_event_id,
    l.start_event_id IS NOT NULL AS is_loss_affected
FROM every_take AS t
JOIN staging.take_subscription AS s ON t.start_event_id = s.start_event_id
LEFT JOIN (SELECT * FROM staging.loss_affected WHERE kind = 'take') AS l
    ON t.start_event_id = l.start_event_id
