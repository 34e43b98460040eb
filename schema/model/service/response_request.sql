-- description: Which request each end of a response answers: at the service the request of the
--     same client and number that it took last before, at the client the one that it sent.
-- grain: one row per end of a response whose request was traced at the same end
-- when: staging.client_event, staging.service_event
WITH taken AS (
    SELECT service_event_id, gid, sequence_number, min(event_id) AS event_id, count(*) AS number
    FROM staging.service_event
    WHERE is_request AND gid IS NOT NULL
    GROUP BY service_event_id, gid, sequence_number
),
sent AS (
    SELECT client_event_id, sequence_number, min(event_id) AS event_id, count(*) AS number
    FROM staging.client_event
    WHERE is_request
    GROUP BY client_event_id, sequence_number
),
-- Nearly every number is used once: only the others need an order.
at_service AS (
    SELECT r.event_id, q.event_id AS request_event_id, q.number, r.service_event_id, r.gid,
        r.sequence_number
    FROM staging.service_event AS r
    JOIN taken AS q
        ON r.service_event_id = q.service_event_id
        AND r.gid = q.gid
        AND r.sequence_number = q.sequence_number
        AND r.event_id >= q.event_id
    WHERE NOT r.is_request
),
at_client AS (
    SELECT r.event_id, q.event_id AS request_event_id, q.number, r.client_event_id,
        r.sequence_number
    FROM staging.client_event AS r
    JOIN sent AS q
        ON r.client_event_id = q.client_event_id
        AND r.sequence_number = q.sequence_number
        AND r.event_id >= q.event_id
    WHERE NOT r.is_request
)
SELECT event_id, request_event_id FROM at_service WHERE number = 1
UNION ALL
SELECT r.event_id, q.event_id
FROM (SELECT * FROM at_service WHERE number > 1) AS r
ASOF JOIN (SELECT * FROM staging.service_event WHERE is_request) AS q
    ON r.service_event_id = q.service_event_id
    AND r.gid = q.gid
    AND r.sequence_number = q.sequence_number
    AND r.event_id >= q.event_id
UNION ALL
SELECT event_id, request_event_id FROM at_client WHERE number = 1
UNION ALL
SELECT r.event_id, q.event_id
FROM (SELECT * FROM at_client WHERE number > 1) AS r
ASOF JOIN (SELECT * FROM staging.client_event WHERE is_request) AS q
    ON r.client_event_id = q.client_event_id
    AND r.sequence_number = q.sequence_number
    AND r.event_id >= q.event_id
