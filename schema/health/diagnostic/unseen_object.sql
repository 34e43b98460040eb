-- name: diagnostic.unseen_object
-- kind: inline
-- description: Objects that were used, but were not seen to be created, by kind. Publishers of ROS
--     itself do not count: /rosout is published on handles never initialised.
-- grain: one row per kind with such objects
WITH unseen AS (
    SELECT 'node' AS kind, process_id FROM staging.node WHERE is_inferred
    UNION ALL
    SELECT 'publisher', process_id FROM staging.publisher WHERE is_inferred AND NOT is_internal
    UNION ALL
    SELECT 'subscription', process_id FROM staging.subscription WHERE is_inferred
    UNION ALL
    SELECT 'timer', process_id FROM staging.timer WHERE created_ns IS NULL
    UNION ALL
    SELECT 'callback', process_id FROM staging.callback WHERE created_ns IS NULL
    UNION ALL
    SELECT 'client', process_id FROM staging.client WHERE created_ns IS NULL
    UNION ALL
    SELECT 'service', process_id FROM staging.service WHERE created_ns IS NULL
)
SELECT
    u.kind,
    count(*) AS count,
    'objects that were used but whose initialisation was not traced (tracing started late, or '
    || 'events were lost), in ' || string_agg(DISTINCT l.label, ', ' ORDER BY l.label) AS detail
FROM unseen AS u
JOIN process_label AS l ON u.process_id = l.process_id
GROUP BY u.kind
