-- name: finding.ignored_events
-- title: Events were left out on request
-- description: The run was ingested without events that its traces hold. What they tell is missing
--     in all results.
-- cause: The option --ignore of msgflow ingest.
-- cure: Ingest again without it: msgflow ingest --replace TRACE.
-- grain: one row per run
-- severity: warning
-- needs: main.diagnostic, main.run
SELECT
    d.run_id,
    r.name AS subject,
    d.count,
    d.detail
FROM main.diagnostic AS d
JOIN main.run AS r ON d.run_id = r.run_id
WHERE d.name = 'ignored_events'
