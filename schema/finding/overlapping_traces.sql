-- name: finding.overlapping_traces
-- title: Two traces hold the same events
-- description: Threads were recorded twice at the same time, by different sessions. What both hold
--     was read from one of them only: that with more events of the thread.
-- cause: Two tracing sessions ran at once with the same events, and both were given to one ingest.
-- cure: None needed, unless one of them is the better record: msgflow ingest --replace TRACE.
-- grain: one row per pair of traces
-- severity: warning
-- needs: main.diagnostic, main.trace
SELECT
    d.run_id,
    coalesce(t.path, 'the input') AS subject,
    d.count,
    d.detail
FROM main.diagnostic AS d
LEFT JOIN main.trace AS t ON d.trace_id = t.trace_id
WHERE d.name = 'overlapping_traces'
