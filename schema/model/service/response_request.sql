-- description: Which request each end of a response answers: at the service the request of the
--     same client and number that it took before, at the client the one that it sent. A number that
--     was taken, or sent, twice tells nothing.
-- grain: one row per end of a response whose request was traced at the same end
-- when: staging.client_event, staging.service_event
WITH taken AS (
    SELECT service_event_id, gid, sequence_number, any_value(event_id) AS event_id
    FROM staging.service_event
    WHERE is_request
    GROUP BY service_event_id, gid, sequence_number
    HAVING count(*) = 1
),
sent AS (
    SELECT client_event_id, sequence_number, any_value(event_id) AS event_id
    FROM staging.client_event
    WHERE is_request
    GROUP BY client_event_id, sequence_number
    HAVING count(*) = 1
)
SELECT r.event_id, q.event_id AS request_event_id
FROM staging.service_event AS r
JOIN taken AS q
    ON r.service_event_id = q.service_event_id
    AND r.gid = q.gid
    AND r.sequence_number = q.sequence_number
    AND r.event_id >= q.event_id
WHERE NOT r.is_request
UNION ALL
SELECT r.event_id, q.event_id
FROM staging.client_event AS r
JOIN sent AS q
    ON r.client_event_id = q.client_event_id
    AND r.sequence_number = q.sequence_number
    AND r.event_id >= q.event_id
WHERE NOT r.is_request
