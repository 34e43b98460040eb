-- name: finding.overlapping_traces
-- title: Two traces hold the same events
-- description: Threads were recorded twice at the same time, by different sessions. Everything they
--     did appears twice, so that messages and callbacks are counted twice or paired wrongly.
-- cause: Two tracing sessions ran at once with the same events, and both were given to one ingest.
-- cure: Ingest only one of them: msgflow ingest --replace TRACE.
-- grain: one row per pair of traces
-- severity: error
-- needs: main.diagnostic, main.trace
SELECT
    d.run_id,
    coalesce(t.path, 'the input') AS subject,
    d.count,
    d.detail
FROM main.diagnostic AS d
LEFT JOIN main.trace AS t ON d.trace_id = t.trace_id
WHERE d.name = 'overlapping_traces'
