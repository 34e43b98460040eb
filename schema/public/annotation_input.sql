-- name: main.annotation_input
-- description: Subscriptions of the declared indirect links.
-- grain: one row per subscription of an annotation
-- column: run_id BIGINT  Run that the row belongs to
-- column: annotation_id BIGINT  The annotation
-- column: subscription_id BIGINT  Its input
-- needs: store.annotation_input
SELECT
    self.run_id,
    self.annotation_id,
    self.subscription_id
FROM store.annotation_input AS self
