-- name: staging.response_request
-- description: Which request each end of a response answers: at the service the request of the
--     same client and number that it took last before, at the client the one that it sent.
-- grain: one row per end of a response whose request was traced at the same end
-- needs: staging.service_event, staging.client_event
SELECT r.event_id, q.event_id AS request_event_id
FROM staging.service_event AS r
ASOF JOIN (SELECT * FROM staging.service_event WHERE is_request) AS q
    ON r.service_event_id = q.service_event_id
    AND r.gid = q.gid
    AND r.sequence_number = q.sequence_number
    AND r.event_id >= q.event_id
WHERE NOT r.is_request
UNION ALL
SELECT r.event_id, q.event_id
FROM staging.client_event AS r
ASOF JOIN (SELECT * FROM staging.client_event WHERE is_request) AS q
    ON r.client_event_id = q.client_event_id
    AND r.sequence_number = q.sequence_number
    AND r.event_id >= q.event_id
WHERE NOT r.is_request
