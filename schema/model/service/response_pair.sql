-- description: Responses as they were sent and taken: by the client's GID, its number of the
--     request, and the stamp; without a stamp on one of the sides, where only one comes into
--     question. Of equal ones the k-th sent is the k-th taken.
-- grain: one row per response whose two ends were traced
-- when: staging.client_event
WITH sent AS (
    SELECT
        event_id, gid, sequence_number, source_timestamp_ns,
        row_number() OVER (
            PARTITION BY gid, sequence_number, source_timestamp_ns ORDER BY event_id
        ) AS position
    FROM staging.service_event
    WHERE NOT is_request AND gid IS NOT NULL
),
taken AS (
    SELECT
        e.event_id, g.gid, e.sequence_number, e.source_timestamp_ns,
        row_number() OVER (
            PARTITION BY g.gid, e.sequence_number, e.source_timestamp_ns ORDER BY e.event_id
        ) AS position
    FROM staging.client_event AS e
    JOIN staging.client_gid AS g ON e.client_event_id = g.client_event_id
    WHERE NOT e.is_request
),
stamped AS (
    SELECT s.event_id AS send_event_id, t.event_id AS take_event_id
    FROM sent AS s
    JOIN taken AS t
        ON s.gid = t.gid
        AND s.sequence_number = t.sequence_number
        AND s.source_timestamp_ns = t.source_timestamp_ns
        AND s.position = t.position
),
single_sent AS (
    SELECT s.gid, s.sequence_number, min(s.event_id) AS event_id,
        min(s.source_timestamp_ns) AS source_timestamp_ns
    FROM sent AS s
    ANTI JOIN stamped AS d ON s.event_id = d.send_event_id
    GROUP BY s.gid, s.sequence_number
    HAVING count(*) = 1
),
single_taken AS (
    SELECT t.gid, t.sequence_number, min(t.event_id) AS event_id,
        min(t.source_timestamp_ns) AS source_timestamp_ns
    FROM taken AS t
    ANTI JOIN stamped AS d ON t.event_id = d.take_event_id
    GROUP BY t.gid, t.sequence_number
    HAVING count(*) = 1
)
SELECT send_event_id, take_event_id FROM stamped
UNION ALL
SELECT s.event_id, t.event_id
FROM single_sent AS s
JOIN single_taken AS t ON s.gid = t.gid AND s.sequence_number = t.sequence_number
WHERE s.source_timestamp_ns IS NULL OR t.source_timestamp_ns IS NULL
