-- description: What callback instances led to by calling services, with the instance that called
--     first: it was called by none itself. A request leads to the instance of the service callback,
--     or is handled without one; its response leads to what the client does with it; both may call
--     other services. The route is a list that tells the way: first the node of the client that the
--     caller used (the negative process where the node is not known, 0 where nothing is), then the
--     services in order (0: not known), each of them once.
-- grain: one row per instance of a service callback, and per request or response that led on
--     without a callback (derive.vertex_key), and route to it
WITH RECURSIVE
-- Whatever a request led to, its response too.
answer AS (
    SELECT
        run_id, request_id,
        derive.vertex_key('callback_instance', callback_instance_id) AS called_key
    FROM store.callback_instance
    WHERE request_id IS NOT NULL
    UNION ALL
    SELECT DISTINCT
        run_id, taken_request_id,
        derive.vertex_key('request', taken_request_id)
    FROM derive.certain_call
    WHERE taken_request_id IS NOT NULL
    UNION ALL
    SELECT
        r.run_id, r.request_id,
        derive.vertex_key('response', r.response_id)
    FROM store.response AS r
    SEMI JOIN derive.certain_call AS l ON r.response_id = l.taken_response_id
    WHERE r.request_id IS NOT NULL
),
called AS MATERIALIZED (
    SELECT
        a.run_id, s.sender_key, a.called_key, q.client_id,
        coalesce(q.service_id, 0) AS service_id
    FROM answer AS a
    JOIN derive.request_sender AS s ON a.request_id = s.request_id
    LEFT JOIN store.request AS q ON a.request_id = q.request_id
),
caller (run_id, called_key, caller_key, client_id, services) AS (
    SELECT
        c.run_id, c.called_key, c.sender_key, c.client_id,
        [c.service_id]
    FROM called AS c
    ANTI JOIN called AS d ON c.sender_key = d.called_key
    WHERE derive.vertex_kind(c.sender_key) = 'callback_instance'
    UNION
    SELECT
        c.run_id, d.called_key, c.caller_key, c.client_id,
        CASE WHEN list_contains(c.services, d.service_id) THEN c.services
            ELSE list_append(c.services, d.service_id) END
    FROM caller AS c
    JOIN called AS d ON c.called_key = d.sender_key
)
SELECT
    c.run_id, c.called_key,
    c.caller_key // 8 AS caller_id,
    list_prepend(coalesce(k.node_id, -k.process_id, 0), c.services)::BIGINT[] AS route
FROM caller AS c
LEFT JOIN store.client AS k ON c.client_id = k.client_id
