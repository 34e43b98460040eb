-- description: Which clients called which services, as requests and responses show.
-- grain: one row per client and service
-- when: staging.client_event
SELECT DISTINCT c.client_event_id, s.service_event_id
FROM (
    SELECT send_event_id AS client_end, take_event_id AS service_end FROM staging.request_pair
    UNION ALL
    SELECT take_event_id, send_event_id FROM staging.response_pair
) AS p
JOIN staging.client_event AS c ON p.client_end = c.event_id
JOIN staging.service_event AS s ON p.service_end = s.event_id
