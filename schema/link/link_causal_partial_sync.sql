-- name: derive.link_causal_partial_sync
-- kind: macro
-- description: Publications that need a message of every input and use each once: the firing's own
--     message is a direct link, of the other inputs the latest counts if it came after the caches
--     were last emptied, and did not fire itself.
-- grain: one row per annotation, publication of a firing, and other input with a message
-- param: only_run BIGINT  Run to look at
-- needs: derive.annotated_input, derive.partial_sync_firing
CREATE OR REPLACE MACRO derive.link_causal_partial_sync(only_run) AS TABLE
WITH firing AS MATERIALIZED (
    SELECT annotation_id, callback_instance_id, emptied_event_id
    FROM derive.partial_sync_firing(only_run)
)
SELECT
    l.run_id, l.callback_instance_id, l.publication_id, l.annotation_id, l.candidate_count,
    l.is_loss_affected
FROM derive.annotated_input(only_run, 'partial_sync') AS l
JOIN firing AS f
    ON l.annotation_id = f.annotation_id AND l.publishing_id = f.callback_instance_id
ANTI JOIN firing AS own
    ON l.annotation_id = own.annotation_id AND l.callback_instance_id = own.callback_instance_id
WHERE coalesce(l.input_end_event_id > f.emptied_event_id, true)
