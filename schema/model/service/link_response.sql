-- description: Responses and what they came from: the instance of the service callback that was
--     called with the request, and, where the response was sent later in another instance, that
--     one too.
-- grain: one row per response and callback instance that it came from
-- when: staging.response
SELECT response_id, callback_instance_id
FROM staging.response
WHERE callback_instance_id IS NOT NULL
UNION
SELECT r.response_id, s.callback_instance_id
FROM staging.response AS r
JOIN staging.sender_run AS s ON r.send_event_id = s.event_id
