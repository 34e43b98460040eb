-- name: staging.response
-- description: Responses; a side that was not traced is NULL.
-- grain: one row per response
-- when: staging.response_origin
SELECT
    r.response_id,
    c.client_id,
    s.service_id,
    r.request_id,
    r.sequence_number,
    r.sent_ns,
    r.taken_ns,
    r.sender_thread_id,
    r.receiver_thread_id,
    i.callback_instance_id
FROM staging.response_origin AS r
LEFT JOIN staging.client AS c ON r.client_event_id = c.event_id
LEFT JOIN staging.service AS s ON r.service_event_id = s.event_id
LEFT JOIN staging.callback_number AS i ON r.callback_start_event_id = i.start_event_id
