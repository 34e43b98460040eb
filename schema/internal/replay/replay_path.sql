-- title: Paths to replay
-- description: The chains that flows can take, each after the one without its last step.
-- grain: one row per chain
SELECT path_id, alike_id, parent_path_id, publisher_id, subscription_id, is_path, path
FROM main.flow_path($runs)
ORDER BY depth, path_id
