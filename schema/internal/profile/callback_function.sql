-- description: The three functions in which a callback was most of its CPU time.
-- grain: one row per function
-- param: node VARCHAR  Its node
-- param: callback VARCHAR  What triggers it
WITH sample AS (
    SELECT 1 AS group_id, s.stack_id, s.cpu_ns
    FROM main.stack_sample AS s
    JOIN main.callback_instance AS i ON s.callback_instance_id = i.callback_instance_id
    JOIN main.callback_label AS l ON i.callback_id = l.callback_id
    WHERE s.run_id = $run_id AND l.node = $node AND l.label = $callback
        AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
)
SELECT f.function, t.self_share, (SELECT count(*) FROM sample) AS all_samples
FROM main.function_time('sample') AS t
JOIN main.stack_frame AS f ON t.stack_frame_id = f.stack_frame_id
WHERE t.self_samples > 0
ORDER BY t.self_samples DESC, f.function, f.file
LIMIT 3
