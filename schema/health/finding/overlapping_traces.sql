-- name: finding.overlapping_traces
-- title: Two traces hold the same events
-- description: Threads were recorded twice at the same time, by two sessions. Where both hold the
--     same events, they were read from one session only: the one with more events of the thread.
-- cause: Two tracing sessions with the same events ran at once, and both were given to one ingest.
-- cure: None needed. To read one of them alone: msgflow ingest --replace TRACE.
-- grain: one row per pair of traces
-- severity: warning
-- phase: reading
SELECT
    d.run_id,
    coalesce(t.path, 'the input') AS subject,
    d.count,
    d.detail
FROM main.diagnostic AS d
LEFT JOIN main.trace AS t ON d.trace_id = t.trace_id
WHERE d.name = 'overlapping_traces'
