-- description: Uses of handles, each with the object of that handle that was initialised last
--     before it, in its process. Both are the names of tables with an event_id, process_id and
--     handle; uses may have other columns as well.
-- grain: one row per use; `object_event_id` is NULL where no such object was initialised before
CREATE OR REPLACE MACRO staging.with_latest(uses, objects) AS TABLE
WITH object AS (
    SELECT event_id, process_id, handle FROM query_table(objects) WHERE handle IS NOT NULL
),
by_handle AS (
    SELECT
        process_id, handle,
        min(event_id) AS first_event_id,
        count(*) > 1 AS is_repeated
    FROM object
    GROUP BY process_id, handle
)
-- Nearly every handle is used once: only the others need an order.
SELECT
    u.*,
    CASE WHEN u.event_id >= k.first_event_id THEN k.first_event_id END AS object_event_id
FROM query_table(uses) AS u
LEFT JOIN by_handle AS k ON u.process_id = k.process_id AND u.handle = k.handle
WHERE k.is_repeated IS DISTINCT FROM true
UNION ALL
SELECT u.*, o.event_id
FROM (
    SELECT s.*
    FROM query_table(uses) AS s
    SEMI JOIN (FROM by_handle WHERE is_repeated) AS r
        ON s.process_id = r.process_id AND s.handle = r.handle
) AS u
ASOF LEFT JOIN object AS o
    ON u.process_id = o.process_id AND u.handle = o.handle AND u.event_id >= o.event_id
