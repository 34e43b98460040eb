-- name: main.annotation_output
-- description: Publishers of the declared indirect links.
-- grain: one row per publisher of an annotation
-- column: run_id BIGINT  Run that the row belongs to
-- column: annotation_id BIGINT  The annotation
-- column: publisher_id BIGINT  Its output
-- needs: store.annotation_output
SELECT
    self.run_id,
    self.annotation_id,
    self.publisher_id
FROM store.annotation_output AS self
