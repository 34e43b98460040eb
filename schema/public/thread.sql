-- name: main.thread
-- description: Threads, each with its last name.
-- grain: one row per thread
-- column: thread_id BIGINT  Identity of the thread
-- column: run_id BIGINT  Run that the row belongs to
-- column: process_id BIGINT  Process it lives in
-- column: tid INTEGER  Thread id; the one inside its PID namespace if the trace has no other
-- column: name VARCHAR  Name of the thread
-- column: first_seen_ns BIGINT [epoch ns]  First event
-- column: last_seen_ns BIGINT [epoch ns]  Last event
-- needs: store.thread, derive.corrected_ns, derive.process_clock
SELECT
    self.thread_id,
    self.run_id,
    self.process_id,
    self.tid,
    self.name,
    derive.corrected_ns(self.first_seen_ns, c.offset_ns, c.drift_ppb, c.reference_ns)
        AS first_seen_ns,
    derive.corrected_ns(self.last_seen_ns, c.offset_ns, c.drift_ppb, c.reference_ns)
        AS last_seen_ns
FROM store.thread AS self
JOIN derive.process_clock AS c ON self.process_id = c.process_id
