-- name: derive.flow_link
-- description: All links in one shape: publication to take, take to the callback run that it was
--     for, callback run (or a take outside of any) to publication. Self loops are left out: flows
--     do not pass through them.
-- grain: one row per link
-- needs: store.link_transport, store.link_causal, store.callback_instance
SELECT
    run_id,
    'publication' AS from_kind, publication_id AS from_id,
    'take' AS to_kind, take_id AS to_id,
    'transport' AS link_kind
FROM store.link_transport
WHERE NOT is_self_loop
UNION ALL
SELECT
    run_id,
    'take', take_id,
    'callback_instance', callback_instance_id,
    'callback'
FROM store.callback_instance
WHERE take_id IS NOT NULL
UNION ALL
SELECT
    run_id,
    CASE WHEN callback_instance_id IS NULL THEN 'take' ELSE 'callback_instance' END,
    coalesce(callback_instance_id, take_id),
    'publication', publication_id,
    kind
FROM store.link_causal
