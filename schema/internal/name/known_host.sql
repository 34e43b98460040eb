-- description: Names of hosts that runs have.
-- grain: one row per host
SELECT
    hostname AS name,
    false AS is_internal
FROM main.host
WHERE list_contains($runs, run_id)
ORDER BY is_internal, name
