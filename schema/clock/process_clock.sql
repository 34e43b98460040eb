-- description: The clock of each process, and how its times are corrected.
-- grain: one row per process
SELECT p.process_id, c.clock_id, c.method, c.offset_ns, c.drift_ppb, c.reference_ns
FROM store.process AS p
JOIN store.host AS h ON p.host_id = h.host_id
JOIN store.clock AS c ON h.clock_id = c.clock_id
