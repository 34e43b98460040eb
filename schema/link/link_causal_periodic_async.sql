-- name: derive.link_causal_periodic_async
-- description: Publications that use the latest message of each input, whatever was used before:
--     the caches are never emptied.
-- grain: one row per annotation, publication by one of its outputs, and other input with a message
-- needs: derive.annotated_input
SELECT
    run_id, callback_instance_id, publication_id, annotation_id, candidate_count,
    is_loss_affected
FROM derive.annotated_input('periodic_async')
