-- name: main.executor_thread
-- description: Threads of the executors.
-- grain: one row per thread of an executor
-- column: run_id BIGINT  Run that the row belongs to
-- column: executor_id BIGINT  The executor
-- column: thread_id BIGINT  The thread
-- needs: store.executor_thread
SELECT
    self.run_id,
    self.executor_id,
    self.thread_id
FROM store.executor_thread AS self
