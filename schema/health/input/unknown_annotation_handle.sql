-- title: Declared links of unknown objects
-- description: Inputs or outputs of declared indirect links are not known subscriptions or
--     publishers. They lead nowhere.
-- cause: The node hands other addresses to the tracepoint of the annotation than those of its
--     subscriptions and publishers, or their creation is not in the trace.
-- cure: Start the session before the nodes; else correct the annotation, or declare the link in a
--     file (msgflow links apply).
-- grain: one row, if there are any
-- severity: warning
-- when: staging.annotation
SELECT
    count(*) AS count,
    'inputs or outputs of declared indirect links that are not known subscriptions or publishers, '
    || 'in ' || string_agg(DISTINCT l.label, ', ' ORDER BY l.label) AS detail
FROM staging.annotation AS a
JOIN staging.annotation_object AS o ON a.event_id = o.event_id
JOIN process_label AS l ON a.process_id = l.process_id
WHERE o.side IS NOT NULL AND o.object_id IS NULL
HAVING count(*) > 0
