-- description: Every request with what was traced of it, numbered in the order of sending: both
--     ends, or only one, and the instance of the service callback.
-- grain: one row per request and service that took it; one per request that no service took
-- when: staging.client_event, staging.service_event
WITH found AS (
    SELECT send_event_id, take_event_id FROM staging.request_pair
    UNION ALL
    SELECT e.event_id, NULL
    FROM staging.client_event AS e
    ANTI JOIN staging.request_pair AS p ON e.event_id = p.send_event_id
    WHERE e.is_request
    UNION ALL
    SELECT NULL, e.event_id
    FROM staging.service_event AS e
    ANTI JOIN staging.request_pair AS p ON e.event_id = p.take_event_id
    WHERE e.is_request
),
-- A client that sent what was taken, although its sending was not traced.
single_gid AS (
    SELECT gid, min(client_event_id) AS client_event_id
    FROM staging.client_gid
    GROUP BY gid
    HAVING count(*) = 1
)
SELECT
    row_number() OVER (
        ORDER BY coalesce(f.send_event_id, f.take_event_id), f.take_event_id
    ) AS request_id,
    f.send_event_id, f.take_event_id, b.start_event_id AS callback_start_event_id,
    coalesce(c.client_event_id, g.client_event_id) AS client_event_id,
    s.service_event_id,
    coalesce(c.sequence_number, s.sequence_number) AS sequence_number,
    c.ts_ns AS sent_ns, s.ts_ns AS taken_ns, c.thread_id AS sender_thread_id,
    s.thread_id AS receiver_thread_id
FROM found AS f
LEFT JOIN staging.client_event AS c ON f.send_event_id = c.event_id
LEFT JOIN staging.service_event AS s ON f.take_event_id = s.event_id
LEFT JOIN single_gid AS g ON s.gid = g.gid
LEFT JOIN staging.callback_binding AS b ON f.take_event_id = b.request_event_id
