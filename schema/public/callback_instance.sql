-- name: main.callback_instance
-- description: Callback instances.
-- grain: one row per callback instance
-- column: callback_instance_id BIGINT  Identity of the callback instance
-- column: run_id BIGINT  Run that the row belongs to
-- column: trace_id BIGINT  Trace it was recorded in
-- column: callback_id BIGINT  Callback that ran
-- column: process_id BIGINT  Process it lives in
-- column: thread_id BIGINT  Thread it happened on
-- column: start_ns BIGINT [epoch ns]  callback_start
-- column: end_ns BIGINT [epoch ns]  callback_end; NULL: never seen to end
-- column: take_id BIGINT  Message it was called with
-- column: request_id BIGINT  Request it was called with
-- column: is_intra_process BOOLEAN  Called with an intra-process message
-- column: parent_id BIGINT  Callback instance that it is nested in
-- column: depth INTEGER  Nesting depth on its thread, from 1
-- column: is_loss_affected BOOLEAN  A gap inside or beside it on its thread may hide its end or
--     what it did
-- needs: store.callback_instance, derive.corrected_ns, derive.process_clock
SELECT
    self.callback_instance_id,
    self.run_id,
    self.trace_id,
    self.callback_id,
    self.process_id,
    self.thread_id,
    derive.corrected_ns(self.start_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS start_ns,
    derive.corrected_ns(self.end_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS end_ns,
    self.take_id,
    self.request_id,
    self.is_intra_process,
    self.parent_id,
    self.depth,
    coalesce(self.is_loss_affected, false) AS is_loss_affected
FROM store.callback_instance AS self
JOIN derive.process_clock AS c ON self.process_id = c.process_id
