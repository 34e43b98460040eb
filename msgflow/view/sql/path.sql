-- name: path
-- title: Paths by number
-- description: The paths that e2e-latency and path-breakdown show, with the objects on them.
-- grain: one row per path
-- param: run BIGINT  Run
-- column: path_id BIGINT  Number of the path
-- column: path VARCHAR  Nodes and topics
-- column: topics VARCHAR[]  Topics in order
-- column: publishers BIGINT[]  Publishers in order
-- column: subscriptions BIGINT[]  Subscriptions in order
-- column: is_cut BOOLEAN  The path goes on or has siblings beyond the limits of the search
-- needs: main.flow_path
SELECT path_id, path, topics, publishers, subscriptions, is_cut
FROM main.flow_path([$run], NULL, NULL)
WHERE is_path
ORDER BY path, path_id
