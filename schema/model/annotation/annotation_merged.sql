-- name: staging.annotation_merged
-- description: Which annotation each message_link event makes or repeats: those of a process with
--     equal kind, inputs and outputs are one.
-- grain: one row per message_link event
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
),
first AS (
    SELECT
        event_id, process_id, kind,
        min(event_id) OVER (PARTITION BY process_id, kind, objects) AS first_event_id
    FROM meant
)
SELECT
    event_id, process_id, kind, first_event_id,
    dense_rank() OVER (ORDER BY first_event_id) AS annotation_id
FROM first
