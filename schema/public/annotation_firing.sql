-- name: main.annotation_firing
-- description: Publications that annotations explain. One is complete where every input has a
--     message: one that an indirect link leads from, or the one that the publishing callback
--     instance was called with. Of partial_sync annotations, only what is published in callback
--     instances of their inputs; all publications of one are one firing.
-- grain: one row per annotation and publication that it applies to
-- column: run_id BIGINT  Run that the row belongs to
-- column: annotation_id BIGINT  The annotation
-- column: publication_id BIGINT  The publication
-- column: callback_instance_id BIGINT  Callback instance that published; NULL: none
-- column: input_count BIGINT  Inputs of the annotation
-- column: linked_count BIGINT  Inputs with a message
-- column: is_complete BOOLEAN  Every input has a message
-- needs: derive.annotation_firing
SELECT
    run_id,
    annotation_id,
    publication_id,
    callback_instance_id,
    input_count,
    linked_count,
    linked_count = input_count AS is_complete
FROM derive.annotation_firing
