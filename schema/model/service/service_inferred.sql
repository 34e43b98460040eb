-- description: Services that were used but never initialised in the trace, with the name that
--     their clients call them by.
-- grain: one row per such service
-- when: staging.service_event WHERE is_inferred, staging.callback_owner WHERE kind = 'service'
WITH learned AS (
    SELECT u.service_event_id, mode(c.service_name ORDER BY c.service_name) AS service_name
    FROM staging.service_use AS u
    JOIN staging.client_known AS c ON u.client_event_id = c.event_id
    GROUP BY u.service_event_id
),
attached AS (
    SELECT e.service_event_id, mode(k.service_handle ORDER BY k.service_handle) AS service_handle
    FROM staging.service_event AS e
    JOIN staging.callback_binding AS b ON e.event_id = b.request_event_id
    JOIN staging.callback_known AS k ON b.callback_event_id = k.event_id
    WHERE e.is_inferred
    GROUP BY e.service_event_id
)
SELECT e.event_id, e.process_id, l.service_name, a.service_handle, e.rmw_handle
FROM staging.service_event AS e
LEFT JOIN learned AS l ON e.event_id = l.service_event_id
LEFT JOIN attached AS a ON e.event_id = a.service_event_id
WHERE e.is_inferred AND e.event_id = e.service_event_id
UNION ALL
SELECT owner_event_id, process_id, NULL, any_value(handle), NULL
FROM staging.callback_owner
WHERE kind = 'service' AND is_inferred
GROUP BY owner_event_id, process_id
