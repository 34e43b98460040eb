-- name: finding.ignored_events
-- title: Events were left out on request
-- description: The run was ingested without some of the events that its traces hold. What they show
--     is missing from all results.
-- cause: The option --ignore of msgflow ingest.
-- cure: Ingest again without the option: msgflow ingest --replace TRACE.
-- grain: one row per run
-- severity: warning
-- phase: reading
SELECT
    d.run_id,
    r.name AS subject,
    d.count,
    d.detail
FROM main.diagnostic AS d
JOIN main.run AS r ON d.run_id = r.run_id
WHERE d.name = 'ignored_events'
