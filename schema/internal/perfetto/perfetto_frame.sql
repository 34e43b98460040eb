-- title: Functions in Perfetto
-- description: Functions of stacks.
-- grain: one row per function and file
-- column: id BIGINT  Function
-- column: name VARCHAR  Its name
-- column: file VARCHAR  Its library, program or source file
-- column: file_id BIGINT  The same for all functions of the file
SELECT
    stack_frame_id AS id, function AS name, file,
    min(stack_frame_id) OVER (PARTITION BY file) AS file_id
FROM main.stack_frame
WHERE run_id = $run_id
ORDER BY stack_frame_id
