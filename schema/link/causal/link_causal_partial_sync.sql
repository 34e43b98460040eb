-- name: derive.link_causal_partial_sync
-- kind: macro
-- description: Publications that need a message of every input and use each message once. The
--     firing's own message is a direct link. Of every other input the latest message counts, if
--     it came after the caches were last emptied and did not fire itself.
-- grain: one row per annotation, publication of a firing, and other input with a message
-- param: only_run BIGINT  Run to look at
-- needs: derive.annotated_input
CREATE OR REPLACE MACRO derive.link_causal_partial_sync(only_run) AS TABLE
SELECT
    run_id, callback_instance_id, publication_id, annotation_id, candidate_count,
    is_loss_affected
FROM derive.annotated_input(only_run, 'partial_sync')
