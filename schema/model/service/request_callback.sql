-- name: staging.request_callback
-- description: Instances of service callbacks with the request that they were called with: the
--     callback_start directly follows its rmw_take_request on the thread, with no event of the
--     executor between the two, and the services agree where both are known.
-- grain: one row per request that was taken and led to a callback instance
-- when: staging.service_event WHERE is_request
SELECT e.event_id AS take_event_id, r.start_event_id
FROM staging.service_event AS e
JOIN staging.callback_pair AS r ON e.event_id = r.previous_event_id
JOIN staging.callback_binding AS b ON r.start_event_id = b.start_event_id
LEFT JOIN staging.callback_known AS k ON b.callback_event_id = k.event_id
WHERE e.is_request
    AND (r.previous_executor_event_id IS NULL OR r.previous_executor_event_id < e.event_id)
    AND NOT r.is_intra_process
    AND coalesce(b.kind IN ('service', 'unknown'), true)
    AND coalesce(k.service_event_id = e.service_event_id, true)
