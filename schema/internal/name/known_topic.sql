-- description: Names of topics that runs have.
-- grain: one row per topic
-- kind: inline
SELECT
    topic_name AS name,
    is_internal
FROM main.publisher
WHERE list_contains($runs, run_id)
UNION
SELECT topic_name, is_internal
FROM main.subscription
WHERE list_contains($runs, run_id)
