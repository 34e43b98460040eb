-- name: main.take
-- description: Messages at the moment they were handed over to a subscription.
-- grain: one row per message handed over to a subscription
-- column: take_id BIGINT  Identity of the take
-- column: run_id BIGINT  Run that the row belongs to
-- column: trace_id BIGINT  Trace it was recorded in
-- column: subscription_id BIGINT  Subscription
-- column: process_id BIGINT  Process it lives in
-- column: thread_id BIGINT  Thread it happened on
-- column: taken_ns BIGINT [epoch ns]  Moment of the hand-over
-- column: source_timestamp_ns BIGINT [epoch ns]  Stamp that came with the message, clock of ROS
-- column: method VARCHAR  'rmw', 'ring_buffer', 'caret' or 'callback_only'
-- column: is_loss_affected BOOLEAN  A gap right before or after it on its thread may hide a
--     layer or its callback
-- needs: store.take, derive.corrected_ns, derive.process_clock
SELECT
    self.take_id,
    self.run_id,
    self.trace_id,
    self.subscription_id,
    self.process_id,
    self.thread_id,
    derive.corrected_ns(self.taken_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS taken_ns,
    self.source_timestamp_ns,
    self.method,
    coalesce(self.is_loss_affected, false) AS is_loss_affected
FROM store.take AS self
JOIN derive.process_clock AS c ON self.process_id = c.process_id
