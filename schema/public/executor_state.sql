-- name: main.executor_state
-- description: What executor threads did, as their three events literally say.
-- grain: one row per interval between two executor events of a thread
-- column: run_id BIGINT  Run that the row belongs to
-- column: executor_id BIGINT  Executor
-- column: thread_id BIGINT  Thread it happened on
-- column: state VARCHAR  'wait', 'process' or 'execute'
-- column: start_ns BIGINT [epoch ns]  Executor event that began it
-- column: end_ns BIGINT [epoch ns]  Next executor event of the thread; NULL: not known
--     (the last, or a gap follows)
-- column: callback_instance_id BIGINT  First callback instance in it
-- needs: store.executor_state, store.thread, derive.corrected_ns, derive.process_clock
SELECT
    self.run_id,
    self.executor_id,
    self.thread_id,
    self.state,
    derive.corrected_ns(self.start_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS start_ns,
    derive.corrected_ns(self.end_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS end_ns,
    self.callback_instance_id
FROM store.executor_state AS self
JOIN store.thread AS t ON self.thread_id = t.thread_id
JOIN derive.process_clock AS c ON t.process_id = c.process_id
