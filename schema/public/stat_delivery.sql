-- description: What became of every message at every subscription of its topic. Only the depth of
--     the queue tells overwriting from loss on the way; incompatible QoS, lifespan and best effort
--     do not show in a trace. Of a ring buffer whose subscription was not traced, only what was
--     taken is listed. The middleware's copy of a message in a ring buffer is not a delivery.
-- grain: one row per publication and subscription of its topic
-- column: run_id, publication_id
-- column: publisher_id BIGINT  Its publisher
-- column: subscription_id BIGINT  Subscription that should have taken it
-- column: take_id BIGINT  Take of the message; NULL: it was not taken, or that is not known
-- column: status VARCHAR  'delivered', 'dropped' (the queue was full), 'lost' (between two that
--     arrived), 'not_connected' (not yet, not any more, or never), 'cut_by_recording' (it ended
--     before it could be taken) or 'unknown' (the trace does not tell)
-- column: reason VARCHAR  Why it was not taken: 'before_subscription', 'subscription_ended',
--     'reader_in_callback', 'receiver_gap', 'never_taken', 'before_discovery', 'no_longer_taken',
--     'take_failed', 'not_delivered', 'overwritten', 'lost_in_transport', 'pending_at_end' or
--     'unknown', the first that holds; NULL: delivered
SELECT
    run_id, publication_id,
    any_value(publisher_id) AS publisher_id,
    subscription_id,
    min(take_id) AS take_id,
    'delivered' AS status,
    NULL::VARCHAR AS reason
FROM store.link_transport
WHERE subscription_id IS NOT NULL AND is_copy IS NOT TRUE
GROUP BY run_id, publication_id, subscription_id
UNION ALL
SELECT
    run_id, publication_id, publisher_id, subscription_id, NULL,
    derive.delivery_status(reason),
    reason
FROM store.undelivered
