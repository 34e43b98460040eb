-- description: Publications by the outputs of annotations of indirect links, with the callback
--     instance that they were made in and its subscription. The cut, before which an input has to
--     be there, is the start of that instance, else that of the publication itself.
-- grain: one row per annotation and publication by one of its outputs
CREATE OR REPLACE MACRO derive.annotated_publication(only_run) AS TABLE
SELECT
    a.run_id, a.annotation_id, a.kind, b.publication_id, b.publisher_id, b.trace_id, b.thread_id,
    b.start_ns, b.start_event_id, i.callback_instance_id,
    coalesce(i.start_event_id, b.start_event_id) AS cut_event_id,
    s.subscription_id
FROM store.annotation AS a
JOIN store.annotation_output AS o ON a.annotation_id = o.annotation_id
JOIN store.publication AS b ON o.publisher_id = b.publisher_id
LEFT JOIN derive.link_causal_direct(only_run) AS d ON b.publication_id = d.publication_id
LEFT JOIN store.callback_instance AS i ON d.callback_instance_id = i.callback_instance_id
LEFT JOIN derive.annotated_run(only_run) AS s ON d.callback_instance_id = s.callback_instance_id
WHERE a.run_id = only_run AND b.run_id = only_run AND a.kind NOT IN ('direct', 'independent')
