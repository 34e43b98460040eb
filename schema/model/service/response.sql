-- description: Responses with what was traced of each, numbered in the order of sending, and the
--     request that each answers: at the service that of the same client and number that it took
--     before, at the client the one that it sent. A number that was taken, or sent, twice tells
--     nothing. A side that was not traced is NULL.
-- grain: one row per response
-- when: staging.client_event, staging.service_event
WITH taken_request AS (
    SELECT
        service_event_id, gid, sequence_number,
        any_value(event_id) AS event_id
    FROM staging.service_event
    WHERE is_request
    GROUP BY service_event_id, gid, sequence_number
    HAVING count(*) = 1
),
sent_request AS (
    SELECT
        client_event_id, sequence_number,
        any_value(event_id) AS event_id
    FROM staging.client_event
    WHERE is_request
    GROUP BY client_event_id, sequence_number
    HAVING count(*) = 1
),
-- Of the ends of the request that of the service says more: several may have taken it.
by_client AS (
    SELECT
        send_event_id,
        min(request_id) AS request_id
    FROM staging.request
    GROUP BY send_event_id
    HAVING count(*) = 1
)
SELECT
    row_number() OVER (ORDER BY coalesce(s.event_id, c.event_id)) AS response_id,
    coalesce(client.client_id, q.client_id) AS client_id,
    coalesce(service.service_id, q.service_id) AS service_id,
    q.request_id,
    coalesce(s.sequence_number, c.sequence_number) AS sequence_number,
    s.ts_ns AS sent_ns,
    c.ts_ns AS taken_ns,
    s.thread_id AS sender_thread_id,
    c.thread_id AS receiver_thread_id,
    q.callback_instance_id,
    s.event_id AS send_event_id,
    c.event_id AS take_event_id
FROM (SELECT * FROM staging.exchange WHERE NOT is_request) AS x
FULL JOIN (SELECT * FROM staging.service_event WHERE NOT is_request) AS s
    ON x.event_at_service = s.event_id
FULL JOIN (SELECT * FROM staging.client_event WHERE NOT is_request) AS c
    ON x.event_at_client = c.event_id
LEFT JOIN taken_request AS t
    ON s.service_event_id = t.service_event_id
    AND s.gid = t.gid
    AND s.sequence_number = t.sequence_number
    AND s.event_id >= t.event_id
LEFT JOIN sent_request AS n
    ON c.client_event_id = n.client_event_id
    AND c.sequence_number = n.sequence_number
    AND c.event_id >= n.event_id
LEFT JOIN staging.request AS answered ON t.event_id = answered.take_event_id
LEFT JOIN by_client AS b ON n.event_id = b.send_event_id
LEFT JOIN staging.request AS q ON q.request_id = coalesce(answered.request_id, b.request_id)
LEFT JOIN staging.client_gid AS g ON s.gid = g.gid AND g.is_single
LEFT JOIN staging.client AS client
    ON client.event_id = coalesce(c.client_event_id, g.client_event_id)
LEFT JOIN staging.service AS service ON s.service_event_id = service.event_id
