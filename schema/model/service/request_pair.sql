-- description: Requests as they were sent and taken: by the client's GID and its number. Every
--     service of the name may take it. Where a client came again with the same GID and numbers,
--     the response tells which request it was, else the order, if as many were taken by a service
--     as were sent.
-- grain: one row per request whose two ends were traced, and service that took it
-- when: staging.client_event
WITH sent AS (
    SELECT e.event_id, g.gid, e.sequence_number
    FROM staging.client_event AS e
    JOIN staging.client_gid AS g ON e.client_event_id = g.client_event_id
    WHERE e.is_request
),
taken AS (
    SELECT event_id, gid, sequence_number, service_event_id
    FROM staging.service_event
    WHERE is_request AND gid IS NOT NULL
),
repeated AS (
    SELECT gid, sequence_number FROM sent GROUP BY gid, sequence_number HAVING count(*) > 1
    UNION
    SELECT gid, sequence_number
    FROM taken
    GROUP BY gid, sequence_number, service_event_id
    HAVING count(*) > 1
),
answered AS (
    SELECT DISTINCT s.request_event_id AS send_event_id, t.request_event_id AS take_event_id
    FROM staging.response_pair AS p
    JOIN staging.response_request AS s ON p.take_event_id = s.event_id
    JOIN staging.response_request AS t ON p.send_event_id = t.event_id
    WHERE s.request_event_id IN (SELECT event_id FROM sent SEMI JOIN repeated
        ON sent.gid = repeated.gid AND sent.sequence_number = repeated.sequence_number)
),
-- What the responses leave open.
ordered_sent AS (
    SELECT
        s.event_id, s.gid, s.sequence_number,
        row_number() OVER (PARTITION BY s.gid, s.sequence_number ORDER BY s.event_id) AS position,
        count(*) OVER (PARTITION BY s.gid, s.sequence_number) AS number
    FROM (
        SELECT * FROM sent
        SEMI JOIN repeated
            ON sent.gid = repeated.gid AND sent.sequence_number = repeated.sequence_number
    ) AS s
    ANTI JOIN answered AS a ON s.event_id = a.send_event_id
),
ordered_taken AS (
    SELECT
        t.event_id, t.gid, t.sequence_number,
        row_number() OVER same_service AS position,
        count(*) OVER (PARTITION BY t.gid, t.sequence_number, t.service_event_id) AS number
    FROM (
        SELECT * FROM taken
        SEMI JOIN repeated
            ON taken.gid = repeated.gid AND taken.sequence_number = repeated.sequence_number
    ) AS t
    ANTI JOIN answered AS a ON t.event_id = a.take_event_id
    WINDOW same_service AS (
        PARTITION BY t.gid, t.sequence_number, t.service_event_id ORDER BY t.event_id
    )
)
SELECT s.event_id AS send_event_id, t.event_id AS take_event_id
FROM sent AS s
JOIN taken AS t ON s.gid = t.gid AND s.sequence_number = t.sequence_number
ANTI JOIN repeated AS r ON s.gid = r.gid AND s.sequence_number = r.sequence_number
UNION ALL
SELECT send_event_id, take_event_id FROM answered
UNION ALL
SELECT s.event_id, t.event_id
FROM ordered_sent AS s
JOIN ordered_taken AS t
    ON s.gid = t.gid
    AND s.sequence_number = t.sequence_number
    AND s.position = t.position
    AND s.number = t.number
