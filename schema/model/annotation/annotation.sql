-- description: Indirect links that the application declared, numbered as they were first. Those of
--     a process with equal kind, inputs and outputs are one.
-- grain: one row per declared indirect link
-- when: staging.annotation_object
WITH meant AS (
    SELECT
        event_id, process_id, kind,
        list_sort(
            list(DISTINCT side || coalesce(object_id::VARCHAR, printf(' %x', handle)))
            FILTER (WHERE side IS NOT NULL)
        ) AS objects
    FROM staging.annotation_object
    GROUP BY event_id, process_id, kind
)
SELECT
    row_number() OVER (ORDER BY min(event_id)) AS annotation_id,
    kind,
    'trace' AS source,
    process_id,
    NULL::BIGINT AS queue_depth,
    min(event_id) AS event_id
FROM meant
GROUP BY process_id, kind, objects
