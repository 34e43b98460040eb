-- name: main.link_causal
-- description: What led to each publication.
-- grain: one row per callback instance, or take outside of any, and publication that it led to
-- column: run_id BIGINT  Run that the row belongs to
-- column: callback_instance_id BIGINT  Cause; NULL: the take itself
-- column: take_id BIGINT  Message that led to it; NULL: none (timers, services)
-- column: publication_id BIGINT  Effect
-- column: kind VARCHAR  'direct', 'periodic_async', 'partial_sync' or 'take_adjacent'
-- column: annotation_id BIGINT  Annotation that declares it; NULL for direct links
-- column: wait_ns BIGINT [ns]  From the end of the callback, or the take, to the publication; 0 for
--     direct links
-- column: candidate_count BIGINT  Callback instances that it could have been; one more if it is the
--     input of an indirect link and had no message when the publishing callback began
-- column: is_loss_affected BOOLEAN  A gap of the trace may hide a better partner
-- needs: store.link_causal, main.callback_instance, main.publication, main.take
SELECT
    l.run_id,
    l.callback_instance_id,
    l.take_id,
    l.publication_id,
    l.kind,
    l.annotation_id,
    CASE l.kind
        WHEN 'direct' THEN 0
        WHEN 'take_adjacent' THEN b.start_ns - t.taken_ns
        ELSE b.start_ns - i.end_ns
    END AS wait_ns,
    l.candidate_count,
    l.is_loss_affected
FROM store.link_causal AS l
LEFT JOIN main.callback_instance AS i
    ON l.callback_instance_id = i.callback_instance_id
JOIN main.publication AS b ON l.publication_id = b.publication_id
LEFT JOIN main.take AS t ON l.kind = 'take_adjacent' AND l.take_id = t.take_id
