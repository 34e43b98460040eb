-- description: Requests as they were sent and taken: by the client's GID and its number. Every
--     service of the name may take it. Where a number was sent or taken twice, nothing tells the
--     requests apart, and none has its other end.
-- grain: one row per request whose two ends were traced, and service that took it
-- when: staging.client_event
WITH sent AS (
    SELECT any_value(e.event_id) AS event_id, g.gid, e.sequence_number
    FROM staging.client_event AS e
    JOIN staging.client_gid AS g ON e.client_event_id = g.client_event_id
    WHERE e.is_request
    GROUP BY g.gid, e.sequence_number
    HAVING count(*) = 1
),
taken AS (
    SELECT any_value(event_id) AS event_id, gid, sequence_number
    FROM staging.service_event
    WHERE is_request
    GROUP BY gid, sequence_number, service_event_id
    HAVING count(*) = 1
)
SELECT s.event_id AS send_event_id, t.event_id AS take_event_id
FROM sent AS s
JOIN taken AS t ON s.gid = t.gid AND s.sequence_number = t.sequence_number
