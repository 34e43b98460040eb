-- description: Indirect links that the application declared, numbered as they were first. Those of
--     a process with equal kind, inputs and outputs are one.
-- grain: one row per declared indirect link
-- when: staging.annotation_event
WITH meant AS (
    SELECT
        e.event_id, e.process_id, e.kind,
        list_sort(
            list(DISTINCT o.side || coalesce(o.object_id::VARCHAR, printf(' %x', o.handle)))
            FILTER (WHERE o.event_id IS NOT NULL)
        ) AS objects
    FROM staging.annotation_event AS e
    LEFT JOIN staging.annotation_object AS o ON e.event_id = o.event_id
    GROUP BY e.event_id, e.process_id, e.kind
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
