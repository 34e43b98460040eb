-- name: main.annotation
-- description: Declared indirect links.
-- grain: one row per declared indirect link
-- column: annotation_id BIGINT  Identity of the annotation
-- column: run_id BIGINT  Run that the row belongs to
-- column: kind VARCHAR  'periodic_async' or 'partial_sync'
-- column: source VARCHAR  'trace' or 'file'
-- column: process_id BIGINT  Process it lives in
-- needs: store.annotation
SELECT
    self.annotation_id,
    self.run_id,
    self.kind,
    self.source,
    self.process_id
FROM store.annotation AS self
