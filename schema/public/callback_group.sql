-- name: main.callback_group
-- description: Callback groups, where the trace has them (CARET). Callbacks of a mutually exclusive
--     group never run at the same time.
-- grain: one row per callback group of an executor
-- column: callback_group_id BIGINT  Identity of the callback group
-- column: run_id BIGINT  Run that the row belongs to
-- column: process_id BIGINT  Process it lives in
-- column: executor_id BIGINT  Executor that it was added to
-- column: kind VARCHAR  'mutually_exclusive', 'reentrant' or 'unknown', as CARET names it
-- needs: store.callback_group
SELECT
    self.callback_group_id,
    self.run_id,
    self.process_id,
    self.executor_id,
    self.kind
FROM store.callback_group AS self
