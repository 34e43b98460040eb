-- name: main.process
-- description: Process lives: a pid that is used again is another process.
-- grain: one row per process life
-- column: process_id BIGINT  Identity of the process life
-- column: run_id BIGINT  Run that the row belongs to
-- column: host_id BIGINT  Host it ran on
-- column: pid INTEGER  Process id; the one inside its PID namespace if the trace has no other
-- column: name VARCHAR  Name of the process (its first thread)
-- column: tracetools_version VARCHAR  Version that rcl_init reported; for display only
-- column: first_seen_ns BIGINT [epoch ns]  First event
-- column: last_seen_ns BIGINT [epoch ns]  Last event
-- column: pid_namespace BIGINT  PID namespace, where the trace has it
-- column: life INTEGER  Number of this life among those of the pid, from 1
-- needs: store.process, derive.corrected_ns, derive.process_clock
SELECT
    self.process_id,
    self.run_id,
    self.host_id,
    self.pid,
    self.name,
    self.tracetools_version,
    derive.corrected_ns(self.first_seen_ns, c.offset_ns, c.drift_ppb, c.reference_ns)
        AS first_seen_ns,
    derive.corrected_ns(self.last_seen_ns, c.offset_ns, c.drift_ppb, c.reference_ns)
        AS last_seen_ns,
    self.pid_namespace,
    self.life
FROM store.process AS self
JOIN derive.process_clock AS c ON self.process_id = c.process_id
