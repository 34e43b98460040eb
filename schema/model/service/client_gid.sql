-- description: The GID of each client. One whose initialisation was not traced learns it from the
--     responses that it took: the number and stamp of a response tell which was sent to it.
--     `is_single`: no other client has it.
-- grain: one row per client with a GID
-- when: staging.client_event, staging.client_known
WITH inferred AS (
    SELECT
        client_event_id AS event_id,
        process_id, rmw_handle
    FROM staging.client_event
    WHERE is_inferred AND event_id = client_event_id
),
stated AS (
    SELECT
        event_id AS client_event_id,
        gid
    FROM staging.client_known
    WHERE gid IS NOT NULL
    UNION ALL
    SELECT
        c.event_id,
        staging.gid_bytes(r.gid)
    FROM inferred AS c
    ASOF JOIN staging.located('raw.ros2_rmw_client_init') AS r
        ON c.process_id = r.process_id
        AND c.rmw_handle = r.rmw_client_handle
        AND c.event_id >= r.event_id
    WHERE staging.gid_bytes(r.gid) IS NOT NULL
),
taken AS (
    SELECT e.client_event_id, e.sequence_number, e.source_timestamp_ns
    FROM staging.client_event AS e
    ANTI JOIN stated AS s ON e.client_event_id = s.client_event_id
    WHERE NOT e.is_request AND e.source_timestamp_ns IS NOT NULL
),
sent AS (
    SELECT
        sequence_number, source_timestamp_ns,
        min(gid) AS gid
    FROM staging.service_event
    WHERE NOT is_request AND source_timestamp_ns IS NOT NULL
    GROUP BY sequence_number, source_timestamp_ns
    HAVING count(*) = 1
),
every_gid AS (
    SELECT client_event_id, gid FROM stated
    UNION ALL
    SELECT
        t.client_event_id,
        mode(s.gid ORDER BY s.gid)
    FROM taken AS t
    JOIN sent AS s
        ON t.sequence_number = s.sequence_number AND t.source_timestamp_ns = s.source_timestamp_ns
    WHERE s.gid IS NOT NULL
    GROUP BY t.client_event_id
)
SELECT
    client_event_id, gid,
    count(*) OVER (PARTITION BY gid) = 1 AS is_single
FROM every_gid
