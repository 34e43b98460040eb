-- name: main.loss_interval
-- description: Gaps in the traces: no two events are paired across one.
-- grain: one row per gap in a trace
-- column: run_id BIGINT  Run that the row belongs to
-- column: trace_id BIGINT  Trace it was recorded in; between two chunks of a recording, the later
-- column: cpu INTEGER  CPU concerned; NULL: all
-- column: kind VARCHAR  'loss' (discarded events), 'packets' (lost packets) or 'pause' (not
--     tracing)
-- column: start_ns BIGINT [epoch ns]  Last moment before the gap
-- column: end_ns BIGINT [epoch ns]  First moment after the gap
-- column: event_count BIGINT  Events lost, where the tracer counted them
-- needs: store.loss_interval, store.trace, store.host, store.clock, derive.corrected_ns
SELECT
    self.run_id,
    self.trace_id,
    self.cpu,
    self.kind,
    derive.corrected_ns(self.start_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS start_ns,
    derive.corrected_ns(self.end_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS end_ns,
    self.event_count
FROM store.loss_interval AS self
JOIN store.trace AS t ON self.trace_id = t.trace_id
JOIN store.host AS h ON t.host_id = h.host_id
JOIN store.clock AS c ON h.clock_id = c.clock_id
