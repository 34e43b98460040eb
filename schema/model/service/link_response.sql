-- name: staging.link_response
-- description: Responses and what they came from: the instance of the service callback that was
--     called with the request, and, where the response was sent later in another instance, that
--     one too.
-- grain: one row per response and callback instance that it came from
-- when: staging.response_origin
SELECT r.response_id, i.callback_instance_id
FROM staging.response_origin AS r
JOIN staging.callback_number AS i ON r.callback_start_event_id = i.start_event_id
UNION
SELECT r.response_id, s.callback_instance_id
FROM staging.response_origin AS r
JOIN staging.sender_run AS s ON r.send_event_id = s.event_id
