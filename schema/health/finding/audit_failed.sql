-- name: finding.audit_failed
-- title: The database contradicts itself
-- description: An audit of the content failed when the run was ingested. Results may be wrong.
-- cause: A mistake in msgflow, or input that it misunderstands.
-- cure: Run msgflow db check, and report what it prints together with the trace.
-- grain: one row per audit
-- severity: error
-- phase: database
SELECT run_id, 'database' AS subject, count, detail
FROM main.diagnostic
WHERE name = 'check_failed'
