-- description: Names of callbacks that runs have.
-- grain: one row per callback
SELECT
    label AS name,
    is_internal
FROM main.callback_label
WHERE list_contains($runs, run_id)
ORDER BY is_internal, name
