-- description: The stacks of samples, the outermost call first.
-- grain: one row per stack
SELECT
    c.stack_id,
    list({'function': f.function, 'file': f.file} ORDER BY c.position) AS frames
FROM main.stack_call AS c
JOIN main.stack_frame AS f ON c.stack_frame_id = f.stack_frame_id
WHERE c.run_id = $run_id
GROUP BY c.stack_id
ORDER BY c.stack_id
