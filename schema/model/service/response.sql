-- description: Responses with what was traced of each, numbered in the order of sending, and the
--     request that each answers. A side that was not traced is NULL.
-- grain: one row per response
-- when: staging.client_event, staging.service_event
WITH found AS (
    SELECT send_event_id, take_event_id FROM staging.response_pair
    UNION ALL
    SELECT e.event_id, NULL
    FROM staging.service_event AS e
    ANTI JOIN staging.response_pair AS p ON e.event_id = p.send_event_id
    WHERE NOT e.is_request
    UNION ALL
    SELECT NULL, e.event_id
    FROM staging.client_event AS e
    ANTI JOIN staging.response_pair AS p ON e.event_id = p.take_event_id
    WHERE NOT e.is_request
),
-- Of the ends of the request that of the service says more: several may have taken it.
by_client AS (
    SELECT send_event_id, min(request_id) AS request_id
    FROM staging.request_origin
    WHERE send_event_id IS NOT NULL
    GROUP BY send_event_id
    HAVING count(*) = 1
),
single_gid AS (
    SELECT gid, min(client_event_id) AS client_event_id
    FROM staging.client_gid
    GROUP BY gid
    HAVING count(*) = 1
),
answered AS (
    SELECT f.send_event_id, f.take_event_id, coalesce(s.request_id, c.request_id) AS request_id
    FROM found AS f
    LEFT JOIN staging.response_request AS sr ON f.send_event_id = sr.event_id
    LEFT JOIN staging.request_origin AS s ON sr.request_event_id = s.take_event_id
    LEFT JOIN staging.response_request AS cr ON f.take_event_id = cr.event_id
    LEFT JOIN by_client AS c ON cr.request_event_id = c.send_event_id
)
SELECT
    row_number() OVER (ORDER BY coalesce(a.send_event_id, a.take_event_id)) AS response_id,
    client.client_id, service.service_id, a.request_id,
    coalesce(s.sequence_number, c.sequence_number) AS sequence_number,
    s.ts_ns AS sent_ns, c.ts_ns AS taken_ns, s.thread_id AS sender_thread_id,
    c.thread_id AS receiver_thread_id, i.callback_instance_id, a.send_event_id, a.take_event_id
FROM answered AS a
LEFT JOIN staging.service_event AS s ON a.send_event_id = s.event_id
LEFT JOIN staging.client_event AS c ON a.take_event_id = c.event_id
LEFT JOIN single_gid AS g ON s.gid = g.gid
LEFT JOIN staging.request_origin AS q ON a.request_id = q.request_id
LEFT JOIN staging.client AS client
    ON client.event_id = coalesce(c.client_event_id, g.client_event_id, q.client_event_id)
LEFT JOIN staging.service AS service
    ON service.event_id = coalesce(s.service_event_id, q.service_event_id)
LEFT JOIN staging.callback_number AS i ON q.callback_start_event_id = i.start_event_id
