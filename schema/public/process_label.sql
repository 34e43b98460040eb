-- description: What people call a process: its nodes. The name of a process alone tells little:
--     that of each node of rclpy is python3, that of each container of components component_conta.
-- grain: one row per process
-- column: run_id
-- column: process_id BIGINT    The process
-- column: nodes VARCHAR        Full names of its first two nodes, and how many more it has; without
--     nodes its name and id, in brackets
-- column: all_nodes VARCHAR[]  Full names of all of its nodes; NULL: none
SELECT
    p.run_id, p.process_id,
    main.node_label(
        array_to_string(n.names[:2], ', ')
        || CASE WHEN len(n.names) > 2 THEN printf(', %d more', len(n.names) - 2) ELSE '' END,
        p.name, p.pid
    ) AS nodes,
    n.names AS all_nodes
FROM main.process AS p
LEFT JOIN (
    SELECT
        process_id,
        list(full_name ORDER BY node_id) AS names
    FROM main.node
    WHERE full_name IS NOT NULL
    GROUP BY process_id
) AS n ON p.process_id = n.process_id
