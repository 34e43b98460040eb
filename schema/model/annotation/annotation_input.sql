-- description: Subscriptions of annotations, as far as they are known.
-- grain: one row per subscription of an annotation
-- when: staging.annotation
SELECT DISTINCT
    a.annotation_id,
    o.object_id AS subscription_id
FROM staging.annotation AS a
JOIN staging.annotation_object AS o ON a.event_id = o.event_id
WHERE o.side = 'input' AND o.object_id IS NOT NULL
ORDER BY ALL
