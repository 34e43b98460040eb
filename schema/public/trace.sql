-- name: main.trace
-- description: CTF traces that were read.
-- grain: one row per CTF trace read
-- column: trace_id BIGINT  Identity of the trace
-- column: run_id BIGINT  Run that the row belongs to
-- column: host_id BIGINT  Host that was traced
-- column: path VARCHAR  Directory as it was given
-- column: uuid VARCHAR  UUID of the trace
-- column: tracer VARCHAR  Tracer and its version
-- column: domain VARCHAR  'ust' or 'kernel'
-- column: start_ns BIGINT [epoch ns]  First event or start of a packet
-- column: end_ns BIGINT [epoch ns]  Last event or end of a packet
-- column: event_count BIGINT  Events read
-- column: discarded_event_count BIGINT  Events that the tracer counted as discarded
-- needs: store.trace, store.host, store.clock, derive.corrected_ns
SELECT
    self.trace_id,
    self.run_id,
    self.host_id,
    self.path,
    self.uuid,
    self.tracer,
    self.domain,
    derive.corrected_ns(self.start_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS start_ns,
    derive.corrected_ns(self.end_ns, c.offset_ns, c.drift_ppb, c.reference_ns) AS end_ns,
    self.event_count,
    self.discarded_event_count
FROM store.trace AS self
JOIN store.host AS h ON self.host_id = h.host_id
JOIN store.clock AS c ON h.clock_id = c.clock_id
