-- description: Network packets that kernel traces recorded at both ends, between hosts of two
--     clocks. A negative latency means that the clocks are apart.
-- grain: one row per network packet and clock that received it from another
-- column: run_id, sent_trace_id, received_trace_id, sent_ns, received_ns
-- column: latency_ns BIGINT [ns]  From sent_ns to received_ns
-- column: protocol, source_address, source_port, destination_address, destination_port,
--     identification, sequence_number
WITH trace_clock AS (
    SELECT t.trace_id, c.*
    FROM store.trace AS t
    JOIN store.host AS h ON t.host_id = h.host_id
    JOIN store.clock AS c ON h.clock_id = c.clock_id
),
corrected AS (
    SELECT
        self.*,
        derive.corrected_ns(self.sent_ns, s) AS from_ns,
        derive.corrected_ns(self.received_ns, r) AS to_ns
    FROM store.link_packet AS self
    JOIN trace_clock AS s ON self.sent_trace_id = s.trace_id
    JOIN trace_clock AS r ON self.received_trace_id = r.trace_id
)
SELECT
    run_id, sent_trace_id, received_trace_id,
    from_ns AS sent_ns,
    to_ns AS received_ns,
    to_ns - from_ns AS latency_ns,
    protocol, source_address, source_port, destination_address, destination_port, identification,
    sequence_number
FROM corrected
