-- description: Recordings: the traces that one ingest read. Nothing is ever linked across runs.
-- grain: one row per ingest of traces that belong together
-- column: run_id, name
-- column: created_at VARCHAR  When the run was ingested: ISO 8601, UTC
-- column: msgflow_version, derivation_hash
-- column: start_ns BIGINT [epoch ns]  First event of any trace but kernel traces
-- column: end_ns BIGINT [epoch ns]  Last event of any trace but kernel traces
-- column: event_count, labels
WITH extent AS (
    SELECT
        t.run_id,
        min(t.start_ns) - min(r.start_ns) AS start_shift_ns,
        max(t.end_ns) - max(r.end_ns) AS end_shift_ns
    FROM main.trace AS t
    JOIN store.trace AS r ON t.trace_id = r.trace_id
    WHERE t.domain IS DISTINCT FROM 'kernel'
    GROUP BY t.run_id
)
SELECT
    self.run_id, self.name,
    strftime(self.created_at, '%Y-%m-%dT%H:%M:%S.%fZ') AS created_at,
    self.msgflow_version, self.derivation_hash,
    self.start_ns + coalesce(e.start_shift_ns, 0) AS start_ns,
    self.end_ns + coalesce(e.end_shift_ns, 0) AS end_ns,
    self.event_count, self.labels
FROM store.run AS self
LEFT JOIN extent AS e ON self.run_id = e.run_id
