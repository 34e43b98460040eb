-- description: Names of the topics, nodes and services that runs have.
-- grain: one row per name
FROM known_topic
UNION
FROM known_node
UNION
SELECT service_name, is_internal FROM main.service WHERE list_contains($runs, run_id)
ORDER BY is_internal, name
