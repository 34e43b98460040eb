-- name: main.link_causal
-- description: What led to each publication.
-- grain: one row per run of a callback and publication that it led to
-- column: run_id BIGINT  Run that the row belongs to
-- column: callback_instance_id BIGINT  Cause
-- column: publication_id BIGINT  Effect
-- column: kind VARCHAR  'direct', 'periodic_async', 'partial_sync' or 'take_adjacent'
-- column: annotation_id BIGINT  Annotation that declares it; NULL for direct links
-- column: wait_ns BIGINT [ns]  From the end of the callback to the publication; 0 for direct links
-- column: candidate_count BIGINT  Runs that it could have been
-- column: is_loss_affected BOOLEAN  A gap of the trace may hide a better partner
-- needs: store.link_causal, main.callback_instance, main.publication
SELECT
    l.run_id,
    l.callback_instance_id,
    l.publication_id,
    l.kind,
    l.annotation_id,
    CASE WHEN l.kind = 'direct' THEN 0 ELSE b.start_ns - i.end_ns END AS wait_ns,
    l.candidate_count,
    l.is_loss_affected
FROM store.link_causal AS l
JOIN main.callback_instance AS i
    ON l.callback_instance_id = i.callback_instance_id
JOIN main.publication AS b ON l.publication_id = b.publication_id
