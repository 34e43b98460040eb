-- description: What the rows of a query would come from, and was not recorded: a sentence each. The
--     note of its header names it. Other events of a run may show that it has no requests or goals.
-- grain: one row per sentence
-- param: note VARCHAR  'requests', 'goals', 'kernel', 'samples', 'usage' or 'callbacks'
WITH lacking AS (
    SELECT
        f.run_id,
        concat(
            CASE WHEN len($runs) > 1 THEN format('run {} ({}): ', r.name, r.run_id) END, f.detail
        ) AS sentence
    FROM main.finding AS f
    JOIN main.run AS r ON f.run_id = r.run_id
    WHERE $note IN ('requests', 'goals') AND list_contains($runs, f.run_id)
        AND f.name = 'missing_layer' AND f.layer = $note
    UNION ALL
    SELECT 0, 'the kernel was not traced: msgflow record --kernel, see docs/scheduling.md'
    WHERE $note = 'kernel'
        AND NOT EXISTS (FROM main.thread_state WHERE list_contains($runs, run_id))
    UNION ALL
    SELECT 0, 'no functions were sampled: msgflow record --profile 99, see docs/functions.md'
    WHERE $note = 'samples'
        AND NOT EXISTS (FROM main.stack_sample WHERE list_contains($runs, run_id))
    UNION ALL
    SELECT 0, 'the system was not sampled: msgflow record does, see docs/record.md'
    WHERE $note = 'usage'
        AND NOT EXISTS (FROM main.host_usage WHERE list_contains($runs, run_id))
    UNION ALL
    SELECT
        0,
        format(
            '{} {} no callbacks, without rclcpp (as those of rclpy): {}; msgflow query '
            'path-breakdown has their times from take to publication',
            count(*),
            if(count(*) = 1, 'process records', 'processes record'),
            string_agg(subject, ', ' ORDER BY subject)
        )
    FROM (
        SELECT DISTINCT subject
        FROM main.finding
        WHERE $note = 'callbacks' AND list_contains($runs, run_id)
            AND name = 'process_without_rclcpp'
    )
    HAVING count(*) > 0
)
SELECT sentence
FROM lacking
ORDER BY run_id
