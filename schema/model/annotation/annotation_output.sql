-- description: Publishers of annotations, as far as they are known.
-- grain: one row per publisher of an annotation
-- when: staging.annotation
SELECT DISTINCT
    a.annotation_id,
    o.object_id AS publisher_id
FROM staging.annotation AS a
JOIN staging.annotation_object AS o ON a.event_id = o.event_id
WHERE o.side = 'output' AND o.object_id IS NOT NULL
ORDER BY ALL
