-- description: Requests with what was traced of each, numbered in the order of sending: both ends,
--     or only one, and the instance of the service callback. A side that was not traced is NULL.
-- grain: one row per request and service that took it; one per request that no service took
-- when: staging.client_event, staging.service_event
SELECT
    row_number() OVER (ORDER BY coalesce(c.event_id, s.event_id), s.event_id) AS request_id,
    client.client_id, service.service_id,
    coalesce(c.sequence_number, s.sequence_number) AS sequence_number,
    c.ts_ns AS sent_ns,
    s.ts_ns AS taken_ns,
    c.thread_id AS sender_thread_id,
    s.thread_id AS receiver_thread_id,
    i.callback_instance_id,
    c.event_id AS send_event_id,
    s.event_id AS take_event_id,
    b.start_event_id AS callback_start_event_id
FROM (SELECT * FROM staging.exchange WHERE is_request) AS x
FULL JOIN (SELECT * FROM staging.client_event WHERE is_request) AS c
    ON x.event_at_client = c.event_id
FULL JOIN (SELECT * FROM staging.service_event WHERE is_request) AS s
    ON x.event_at_service = s.event_id
-- A client that sent what was taken, although its sending was not traced.
LEFT JOIN staging.client_gid AS g ON s.gid = g.gid AND g.is_single
LEFT JOIN staging.client AS client
    ON client.event_id = coalesce(c.client_event_id, g.client_event_id)
LEFT JOIN staging.service AS service ON s.service_event_id = service.event_id
LEFT JOIN staging.callback_binding AS b ON s.event_id = b.request_event_id
LEFT JOIN staging.callback_number AS i ON b.start_event_id = i.start_event_id
