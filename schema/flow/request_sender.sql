-- description: What sent a request, as flows follow it: a callback instance, or a request or
--     response that the thread had taken without a callback (derive.vertex_key).
-- grain: one row per request with a known cause
SELECT
    request_id,
    derive.vertex_key('callback_instance', callback_instance_id) AS sender_key
FROM derive.certain_request
UNION ALL
SELECT
    request_id,
    derive.vertex_key(from_kind, from_id)
FROM derive.certain_call
WHERE request_id IS NOT NULL
