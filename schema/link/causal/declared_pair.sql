-- description: Inputs and outputs that annotations declare.
-- grain: one row per annotation, input and output
SELECT a.run_id, a.kind, i.subscription_id, o.publisher_id
FROM store.annotation AS a
JOIN store.annotation_input AS i ON a.annotation_id = i.annotation_id
JOIN store.annotation_output AS o ON a.annotation_id = o.annotation_id
