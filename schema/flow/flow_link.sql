-- description: All links in one shape: publication to take, take or request to the callback
--     instance that it was for, callback instance (or a take without one) to publication,
--     callback instance to request or response. Where no service callback was traced, a request
--     leads to its response. What was sent after a request or response was taken, in no callback,
--     follows from that. Self loops are left out: flows do not pass through them.
-- grain: one row per cause, effect and kind of link
SELECT
    run_id,
    'publication' AS from_kind,
    publication_id AS from_id,
    'take' AS to_kind,
    take_id AS to_id,
    'transport' AS link_kind
FROM store.link_transport
WHERE NOT is_self_loop
UNION ALL
SELECT run_id, 'take', take_id, 'callback_instance', callback_instance_id, 'callback'
FROM store.callback_instance
WHERE take_id IS NOT NULL
UNION ALL
SELECT
    run_id,
    CASE WHEN callback_instance_id IS NULL THEN 'take' ELSE 'callback_instance' END,
    coalesce(callback_instance_id, take_id),
    'publication', publication_id,
    kind
FROM derive.flow_cause
UNION ALL
SELECT run_id, 'callback_instance', callback_instance_id, 'request', request_id, 'direct'
FROM derive.certain_request
UNION ALL
SELECT run_id, 'request', request_id, 'callback_instance', callback_instance_id, 'callback'
FROM store.callback_instance
WHERE request_id IS NOT NULL
UNION ALL
SELECT
    l.run_id,
    'callback_instance', l.callback_instance_id,
    'response', l.response_id,
    CASE WHEN l.callback_instance_id = r.callback_instance_id THEN 'service' ELSE 'direct' END
FROM store.link_response AS l
JOIN store.response AS r ON l.response_id = r.response_id
UNION ALL
SELECT run_id, 'request', request_id, 'response', response_id, 'service'
FROM store.response
WHERE callback_instance_id IS NULL AND request_id IS NOT NULL
UNION ALL
SELECT run_id, from_kind, from_id, to_kind, to_id, 'take_adjacent' FROM derive.certain_call
