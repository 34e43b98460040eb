-- name: derive.flow_caller
-- description: Callback instances on whose request service callbacks ran: directly, or through
--     other services in between. The route is a list that tells the way: first the node of the
--     client that the caller used (the negative process where the node is not known, 0 where
--     nothing is), then the services in order (0: not known), each of them once.
-- grain: one row per instance of a service callback, callback instance that called it, and route
WITH RECURSIVE called AS (
    SELECT
        i.run_id, i.callback_instance_id, l.callback_instance_id AS caller_id, q.client_id,
        coalesce(q.service_id, 0) AS service_id
    FROM store.callback_instance AS i
    JOIN store.link_request AS l ON i.request_id = l.request_id
    LEFT JOIN store.request AS q ON i.request_id = q.request_id
    WHERE i.request_id IS NOT NULL AND l.callback_instance_id IS NOT NULL
),
caller (run_id, callback_instance_id, caller_id, client_id, services) AS (
    SELECT run_id, callback_instance_id, caller_id, client_id, [service_id] FROM called
    UNION
    SELECT
        c.run_id, c.callback_instance_id, d.caller_id, d.client_id,
        CASE WHEN list_contains(c.services, d.service_id) THEN c.services
            ELSE list_prepend(d.service_id, c.services) END
    FROM caller AS c
    JOIN called AS d ON c.caller_id = d.callback_instance_id
)
SELECT
    c.run_id,
    c.callback_instance_id,
    c.caller_id,
    list_prepend(coalesce(k.node_id, -k.process_id, 0), c.services)::BIGINT[] AS route
FROM caller AS c
LEFT JOIN store.client AS k ON c.client_id = k.client_id
