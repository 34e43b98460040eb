-- name: main.stat_delivery
-- description: What became of every message at every subscription of its topic. Whether a message
--     was overwritten in the queue or lost on the way is told by the depth of the queue alone;
--     incompatible QoS, lifespan and best effort do not show in a trace. Of a ring buffer whose
--     subscription was not traced there is only what was taken from it. The copy by the middleware
--     of what a ring buffer carries is no delivery: no callback gets it.
-- grain: one row per publication and subscription of its topic
-- column: run_id BIGINT  Run that the row belongs to
-- column: publication_id BIGINT  The message
-- column: publisher_id BIGINT  Its publisher
-- column: subscription_id BIGINT  Who should have taken it
-- column: take_id BIGINT  Where it was taken; NULL: not, or not known
-- column: status VARCHAR  'delivered', 'skipped' (newer messages took its place), 'lost',
--     'unconnected' (before or after the two were connected, as far as traced) or 'unknown'
-- column: reason VARCHAR  Why it was not taken: 'before_subscription', 'subscription_ended',
--     'receiver_gap', 'take_failed', 'before_discovery', 'not_delivered', 'overwritten',
--     'lost_in_transport', 'pending_at_end' or 'unknown', the first that holds; NULL: delivered
-- needs: store.link_transport, store.undelivered, derive.delivery_status
SELECT
    run_id,
    publication_id,
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
    run_id,
    publication_id,
    publisher_id,
    subscription_id,
    NULL,
    derive.delivery_status(reason),
    reason
FROM store.undelivered
