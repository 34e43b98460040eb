-- description: What caused each publication.
-- grain: one row per publication, and callback instance, or take without one, that caused it
-- column: run_id, callback_instance_id, take_id, publication_id, kind, annotation_id
-- column: wait_ns BIGINT [ns]  From the end of the callback, or the take, to the publication; 0 for
--     direct links
-- column: candidate_count, is_loss_affected
-- column: is_followed BOOLEAN  Flows and paths follow it
SELECT
    l.run_id, l.callback_instance_id, l.take_id, l.publication_id, l.kind, l.annotation_id,
    CASE l.kind
        WHEN 'direct' THEN 0
        WHEN 'take_adjacent' THEN b.start_ns - t.taken_ns
        WHEN 'polled' THEN b.start_ns - t.taken_ns
        ELSE b.start_ns - i.end_ns
    END AS wait_ns,
    l.candidate_count, l.is_loss_affected,
    derive.is_followed(l.kind, l.candidate_count) AS is_followed
FROM store.link_causal AS l
LEFT JOIN main.callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
JOIN main.publication AS b ON l.publication_id = b.publication_id
LEFT JOIN main.take AS t ON l.kind IN ('take_adjacent', 'polled') AND l.take_id = t.take_id
