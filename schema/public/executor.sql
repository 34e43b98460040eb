-- name: main.executor
-- description: Executors.
-- grain: one row per executor
-- column: executor_id BIGINT  Identity of the executor
-- column: run_id BIGINT  Run that the row belongs to
-- column: process_id BIGINT  Process it lives in
-- column: kind VARCHAR  'single_threaded', 'multi_threaded', 'unknown', or as CARET names it
-- column: is_inferred BOOLEAN  Deduced from the threads that run the same callbacks
-- needs: store.executor
SELECT
    self.executor_id,
    self.run_id,
    self.process_id,
    self.kind,
    self.is_inferred
FROM store.executor AS self
