-- name: main.timer
-- description: Timers. If the initialisation of a timer was not traced, its period is not known.
-- grain: one row per timer
-- column: timer_id BIGINT  Identity of the timer
-- column: run_id BIGINT  Run that the row belongs to
-- column: process_id BIGINT  Process it lives in
-- column: node_id BIGINT  Node it belongs to
-- column: period_ns BIGINT [ns]  Period; NULL: not known
-- column: timer_handle UBIGINT  rcl timer handle; an address, valid in its process until reused
-- column: created_ns BIGINT [epoch ns]  rcl_timer_init
-- column: is_inferred BOOLEAN  Its initialisation was not traced
-- needs: store.timer, derive.corrected_ns, derive.process_clock
SELECT
    self.timer_id,
    self.run_id,
    self.process_id,
    self.node_id,
    self.period_ns,
    self.timer_handle,
    derive.corrected_ns(self.created_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS created_ns,
    self.created_ns IS NULL AS is_inferred
FROM store.timer AS self
JOIN derive.process_clock AS c ON self.process_id = c.process_id
