-- description: Publications that annotations explain. One is complete if every input has a message:
--     an indirect link comes from it, or the publishing callback instance was called with it. For
--     partial_sync and approximate_sync: only publications from callback instances of inputs; all
--     of one instance are one firing.
-- grain: one row per annotation and publication that it applies to
-- column: run_id BIGINT  Run that the row belongs to
-- column: annotation_id BIGINT  The annotation
-- column: publication_id BIGINT  The publication
-- column: callback_instance_id BIGINT  Callback instance that published; NULL: none
-- column: input_count BIGINT  Inputs of the annotation
-- column: linked_count BIGINT  Inputs with a message
-- column: is_complete BOOLEAN  Every input has a message
SELECT
    run_id, annotation_id, publication_id, callback_instance_id, input_count, linked_count,
    linked_count = input_count AS is_complete
FROM derive.annotation_firing
