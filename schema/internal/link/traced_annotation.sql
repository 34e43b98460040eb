-- description: The annotations of a run that its trace declares, with their endpoints: those among
--     a file are not stored again.
-- grain: one row per annotation
-- kind: inline
SELECT
    a.kind, a.process_id,
    (
        SELECT list(i.subscription_id ORDER BY i.subscription_id)
        FROM store.annotation_input AS i
        WHERE i.annotation_id = a.annotation_id
    ) AS inputs,
    (
        SELECT list(o.publisher_id ORDER BY o.publisher_id)
        FROM store.annotation_output AS o
        WHERE o.annotation_id = a.annotation_id
    ) AS outputs
FROM store.annotation AS a
WHERE a.run_id = $run_id AND a.source = 'trace'
ORDER BY a.annotation_id
