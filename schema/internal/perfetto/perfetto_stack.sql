-- kind: inline
-- description: The stacks of samples, the outermost call first.
-- grain: one row per stack
SELECT stack_id, list(stack_frame_id ORDER BY position) AS frames
FROM main.stack_call
WHERE run_id = $run_id
GROUP BY stack_id
ORDER BY stack_id
