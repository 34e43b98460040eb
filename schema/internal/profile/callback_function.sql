-- description: Of some callbacks the one with most samples, and the three functions in which most
--     of these were.
-- grain: one row per function
-- when: main.stack_sample WHERE list_contains($runs, run_id)
-- next: query functions --node {node} --callback {callback}
-- param: callbacks VARCHAR[][]  Node of each, and what triggers it
-- column: node VARCHAR  Node
-- column: callback VARCHAR  What triggers the callback
-- column: function VARCHAR  Function
-- column: self_share DOUBLE  Its share of the CPU time
-- column: all_samples BIGINT  Samples of the callback
WITH sampled AS (
    SELECT
        l.node,
        l.label AS callback,
        s.stack_id, s.cpu_ns
    FROM main.stack_sample AS s
    JOIN main.callback_instance AS i ON s.callback_instance_id = i.callback_instance_id
    JOIN main.callback_label AS l ON i.callback_id = l.callback_id
    WHERE list_contains($runs, s.run_id) AND list_contains($callbacks, [l.node, l.label])
        AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
),
longest AS (
    SELECT
        node, callback,
        count(*) AS all_samples
    FROM sampled
    GROUP BY node, callback
    ORDER BY all_samples DESC, node, callback
    LIMIT 1
),
sample AS (
    SELECT 1 AS group_id, s.stack_id, s.cpu_ns
    FROM sampled AS s
    JOIN longest AS l ON s.node = l.node AND s.callback = l.callback
)
SELECT l.node, l.callback, f.function, t.self_share, l.all_samples
FROM main.function_time('sample') AS t
CROSS JOIN longest AS l
JOIN main.stack_frame AS f ON t.stack_frame_id = f.stack_frame_id
WHERE t.self_samples > 0
ORDER BY t.self_samples DESC, f.function, f.file
LIMIT 3
