-- description: Requests; a side that was not traced is NULL.
-- grain: one row per request and service that took it; one per request that no service took
-- when: staging.request_origin
SELECT
    q.request_id, c.client_id, s.service_id, q.sequence_number, q.sent_ns, q.taken_ns,
    q.sender_thread_id, q.receiver_thread_id, i.callback_instance_id
FROM staging.request_origin AS q
LEFT JOIN staging.client AS c ON q.client_event_id = c.event_id
LEFT JOIN staging.service AS s ON q.service_event_id = s.event_id
LEFT JOIN staging.callback_number AS i ON q.callback_start_event_id = i.start_event_id
