-- description: Stretches of time in which all threads of an executor with several threads ran
--     callbacks. `before_ns` is the sum of the earlier stretches.
-- grain: one row per such stretch
WITH edge AS (
    SELECT
        r.run_id, r.executor_id, unnest([r.start_ns, r.end_ns]) AS at_ns, unnest([1, -1]) AS step
    FROM derive.executor_run AS r
    JOIN derive.executor_size AS s ON r.executor_id = s.executor_id
    WHERE s.thread_count > 1
),
level AS (
    SELECT
        run_id, executor_id, at_ns AS start_ns,
        lead(at_ns) OVER in_time AS end_ns,
        sum(step) OVER (in_time ROWS UNBOUNDED PRECEDING) AS running
    FROM edge
    WINDOW in_time AS (PARTITION BY run_id, executor_id ORDER BY at_ns, step)
)
SELECT
    l.run_id, l.executor_id, l.start_ns, l.end_ns,
    coalesce(sum(l.end_ns - l.start_ns) OVER (
        PARTITION BY l.run_id, l.executor_id ORDER BY l.start_ns
        ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
    ), 0)::BIGINT AS before_ns
FROM level AS l
JOIN derive.executor_size AS s ON l.executor_id = s.executor_id
WHERE l.running >= s.thread_count AND l.end_ns > l.start_ns
