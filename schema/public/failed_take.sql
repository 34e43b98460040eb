-- name: main.failed_take
-- description: Attempts to take from a subscription that got nothing.
-- grain: one row per attempt that took nothing
-- column: run_id BIGINT  Run that the row belongs to
-- column: trace_id BIGINT  Trace it was recorded in
-- column: subscription_id BIGINT  Subscription
-- column: process_id BIGINT  Process it lives in
-- column: thread_id BIGINT  Thread it happened on
-- column: failed_ns BIGINT [epoch ns]  Moment of the attempt
-- needs: store.failed_take, derive.corrected_ns, derive.process_clock
SELECT
    self.run_id,
    self.trace_id,
    self.subscription_id,
    self.process_id,
    self.thread_id,
    derive.corrected_ns(self.failed_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS failed_ns
FROM store.failed_take AS self
JOIN derive.process_clock AS c ON self.process_id = c.process_id
