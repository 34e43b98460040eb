-- description: Stretches of time in which at least one thread of an executor with several threads
--     ran a callback. `before_ns` is the sum of the earlier stretches of the callback.
-- grain: one row per such stretch
WITH run AS (
    SELECT
        r.run_id, r.executor_id, r.callback_id, r.start_ns, r.end_ns,
        coalesce(r.start_ns > max(r.end_ns) OVER (
            in_time ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ), true) AS is_first
    FROM derive.executor_run AS r
    JOIN derive.executor_size AS s ON r.executor_id = s.executor_id
    WHERE s.thread_count > 1 AND r.end_ns > r.start_ns
    WINDOW in_time AS (
        PARTITION BY r.run_id, r.executor_id, r.callback_id
        ORDER BY r.start_ns, r.callback_instance_id
    )
),
numbered AS (
    SELECT
        run_id, executor_id, callback_id, start_ns, end_ns,
        count(*) FILTER (WHERE is_first) OVER (
            PARTITION BY run_id, executor_id, callback_id ORDER BY start_ns
        ) AS stretch
    FROM run
),
stretch AS (
    SELECT run_id, executor_id, callback_id, min(start_ns) AS start_ns, max(end_ns) AS end_ns
    FROM numbered
    GROUP BY run_id, executor_id, callback_id, stretch
)
SELECT
    run_id, executor_id, callback_id, start_ns, end_ns,
    coalesce(sum(end_ns - start_ns) OVER (
        PARTITION BY run_id, executor_id, callback_id ORDER BY start_ns
        ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
    ), 0)::BIGINT AS before_ns
FROM stretch
