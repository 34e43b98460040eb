-- description: Names of nodes that runs have, and of processes whose node is unknown.
-- grain: one row per node
-- kind: inline
SELECT
    full_name AS name,
    false AS is_internal
FROM main.node
WHERE list_contains($runs, run_id)
UNION
SELECT node, false
FROM main.callback_label
WHERE list_contains($runs, run_id)
UNION
SELECT
    main.node_label(NULL, name, pid),
    false
FROM main.process
WHERE list_contains($runs, run_id)
