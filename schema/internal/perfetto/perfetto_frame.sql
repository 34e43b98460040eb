-- kind: inline
-- description: Functions of stacks.
-- grain: one row per function and file
SELECT
    stack_frame_id AS id, function AS name, file,
    min(stack_frame_id) OVER (PARTITION BY file) AS file_id
FROM main.stack_frame
WHERE run_id = $run_id
ORDER BY stack_frame_id
