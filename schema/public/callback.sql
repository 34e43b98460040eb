-- name: main.callback
-- description: Callback objects and what they belong to.
-- grain: one row per callback object
-- column: callback_id BIGINT  Identity of the callback
-- column: run_id BIGINT  Run that the row belongs to
-- column: process_id BIGINT  Process it lives in
-- column: node_id BIGINT  Node it belongs to
-- column: kind VARCHAR  'subscription', 'timer', 'service' or 'unknown'
-- column: subscription_id BIGINT  Its subscription
-- column: timer_id BIGINT  Its timer
-- column: service_id BIGINT  Its service
-- column: callback_handle UBIGINT  Address of the callback object; an address, valid in its
--     process until reused
-- column: symbol VARCHAR  Function registered for it; NULL: none or unresolvable
-- column: created_ns BIGINT [epoch ns]  First initialisation event
-- needs: store.callback, derive.corrected_ns, derive.process_clock
SELECT
    self.callback_id,
    self.run_id,
    self.process_id,
    self.node_id,
    self.kind,
    self.subscription_id,
    self.timer_id,
    self.service_id,
    self.callback_handle,
    self.symbol,
    derive.corrected_ns(self.created_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS created_ns
FROM store.callback AS self
JOIN derive.process_clock AS c ON self.process_id = c.process_id
