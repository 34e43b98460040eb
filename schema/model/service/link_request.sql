-- description: Requests and the callback instance that sent them; NULL where the thread did so by
--     itself.
-- grain: one row per request that was seen to be sent
-- when: staging.request
SELECT q.request_id, r.callback_instance_id
FROM staging.request AS q
LEFT JOIN staging.sender_run AS r ON q.send_event_id = r.event_id
WHERE q.send_event_id IS NOT NULL
