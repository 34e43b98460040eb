-- description: Callback instances that requests and responses were sent in. Of a step of Python it
--     is the first one of the call.
-- grain: one row per request or response sent inside a callback instance
-- when: staging.client_event, staging.service_event
WITH send AS (
    SELECT event_id, thread_id FROM staging.client_event WHERE is_request
    UNION ALL
    SELECT event_id, thread_id FROM staging.service_event WHERE NOT is_request
)
SELECT s.event_id, n.callback_instance_id
FROM staging.innermost_run('send') AS s
JOIN staging.callback_binding AS b ON s.start_event_id = b.start_event_id
JOIN staging.callback_number AS n
    ON n.start_event_id = coalesce(b.call_event_id, b.start_event_id)
