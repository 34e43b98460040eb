-- name: derive.link_causal_periodic_async
-- kind: macro
-- description: Publications that use the latest message of each input, whatever was used before:
--     the caches are never emptied.
-- grain: one row per annotation, publication by one of its outputs, and other input with a message
-- param: only_run BIGINT  Run to look at
-- needs: derive.annotated_input
CREATE OR REPLACE MACRO derive.link_causal_periodic_async(only_run) AS TABLE
SELECT
    run_id, callback_instance_id, publication_id, annotation_id, candidate_count,
    is_loss_affected
FROM derive.annotated_input(only_run, 'periodic_async')
