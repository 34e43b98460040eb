-- title: Declared links to replay
-- description: Inputs and outputs of links that callbacks keep messages for.
-- grain: one row per annotation
SELECT
    a.annotation_id, a.kind,
    (
        SELECT list(DISTINCT i.subscription_id ORDER BY i.subscription_id)
        FROM main.annotation_input AS i
        WHERE i.annotation_id = a.annotation_id
    ) AS inputs,
    (
        SELECT list(DISTINCT o.publisher_id ORDER BY o.publisher_id)
        FROM main.annotation_output AS o
        WHERE o.annotation_id = a.annotation_id
    ) AS outputs
FROM main.annotation AS a
WHERE a.run_id = $run_id AND a.kind IN ('periodic_async', 'partial_sync')
ORDER BY a.annotation_id
