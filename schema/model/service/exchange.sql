-- description: Requests and responses that were traced at both ends, the client and the service:
--     by the client's GID, its number of the request and, of a response, the stamp;
--     without a stamp on one of the sides, where only one comes into question. Of equal responses
--     the k-th sent is the k-th taken. Every service of the name may take a request. Where a number
--     was sent or taken twice, nothing tells the requests apart, and none has its other end.
-- grain: one row per request and service that took it, and per response
-- when: staging.client_event
WITH at_client AS (
    SELECT
        e.event_id, e.is_request, e.client_event_id, g.gid, e.sequence_number,
        e.source_timestamp_ns AS stamp,
        row_number() OVER (
            PARTITION BY g.gid, e.sequence_number, e.source_timestamp_ns ORDER BY e.event_id
        ) AS position
    FROM staging.client_event AS e
    JOIN staging.client_gid AS g ON e.client_event_id = g.client_event_id
),
at_service AS (
    SELECT
        event_id, is_request, service_event_id, gid, sequence_number,
        source_timestamp_ns AS stamp,
        row_number() OVER (
            PARTITION BY gid, sequence_number, source_timestamp_ns ORDER BY event_id
        ) AS position
    FROM staging.service_event
    WHERE gid IS NOT NULL
),
-- Requests have no stamp.
stamped AS (
    SELECT
        false AS is_request,
        c.event_id AS event_at_client,
        s.event_id AS event_at_service,
        c.client_event_id, s.service_event_id
    FROM at_client AS c
    JOIN at_service AS s
        ON c.gid = s.gid
        AND c.sequence_number = s.sequence_number
        AND c.stamp = s.stamp
        AND c.position = s.position
),
single_at_client AS (
    SELECT
        is_request, gid, sequence_number,
        any_value(event_id) AS event_id,
        any_value(client_event_id) AS client_event_id,
        any_value(stamp) AS stamp
    FROM at_client
    WHERE event_id NOT IN (SELECT event_at_client FROM stamped)
    GROUP BY is_request, gid, sequence_number
    HAVING count(*) = 1
),
single_at_service AS (
    SELECT
        is_request, gid, sequence_number,
        any_value(event_id) AS event_id,
        any_value(service_event_id) AS service_event_id,
        any_value(stamp) AS stamp
    FROM at_service
    WHERE event_id NOT IN (SELECT event_at_service FROM stamped)
    GROUP BY is_request, gid, sequence_number, CASE WHEN is_request THEN service_event_id END
    HAVING count(*) = 1
)
SELECT is_request, event_at_client, event_at_service, client_event_id, service_event_id
FROM stamped
UNION ALL
SELECT c.is_request, c.event_id, s.event_id, c.client_event_id, s.service_event_id
FROM single_at_client AS c
JOIN single_at_service AS s
    ON c.is_request = s.is_request AND c.gid = s.gid AND c.sequence_number = s.sequence_number
WHERE c.stamp IS NULL OR s.stamp IS NULL
