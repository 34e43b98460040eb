-- name: staging.annotation
-- description: Indirect links that the application declared, numbered as they were first.
-- grain: one row per declared indirect link
-- when: staging.annotation_merged
SELECT annotation_id, kind, 'trace' AS source, process_id, event_id
FROM staging.annotation_merged
WHERE event_id = first_event_id
