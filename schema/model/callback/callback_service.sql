-- name: staging.callback_service
-- description: The service whose requests callbacks were called with; of several the most frequent.
-- grain: one row per callback that was called with a request
-- when: staging.request_callback
SELECT
    b.process_id,
    b.callback_handle,
    b.callback_event_id,
    mode(s.service_id ORDER BY s.service_id) AS service_id
FROM staging.callback_binding AS b
JOIN staging.request_callback AS r ON b.start_event_id = r.start_event_id
JOIN staging.service_event AS e ON r.take_event_id = e.event_id
JOIN staging.service AS s ON e.service_event_id = s.event_id
GROUP BY b.process_id, b.callback_handle, b.callback_event_id
