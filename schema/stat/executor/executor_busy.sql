-- name: derive.executor_busy
-- description: Stretches of time in which no thread of an executor was free to start a callback:
--     each of them ran one. With the sum of all such time before.
-- grain: one row per stretch in which all threads of an executor ran callbacks
-- needs: derive.executor_run, derive.executor_size
WITH edge AS (
    SELECT r.run_id, r.executor_id, r.start_ns AS at_ns, 1 AS step
    FROM derive.executor_run AS r
    JOIN derive.executor_size AS s ON r.executor_id = s.executor_id
    WHERE s.thread_count > 1
    UNION ALL
    SELECT r.run_id, r.executor_id, r.end_ns, -1
    FROM derive.executor_run AS r
    JOIN derive.executor_size AS s ON r.executor_id = s.executor_id
    WHERE s.thread_count > 1
),
level AS (
    SELECT
        run_id,
        executor_id,
        at_ns AS start_ns,
        lead(at_ns) OVER in_time AS end_ns,
        sum(step) OVER (in_time ROWS UNBOUNDED PRECEDING) AS running
    FROM edge
    WINDOW in_time AS (PARTITION BY run_id, executor_id ORDER BY at_ns, step)
),
stretch AS (
    SELECT l.run_id, l.executor_id, l.start_ns, l.end_ns
    FROM level AS l
    JOIN derive.executor_size AS s ON l.executor_id = s.executor_id
    WHERE l.running >= s.thread_count AND l.end_ns > l.start_ns
    UNION ALL
    SELECT r.run_id, r.executor_id, r.start_ns, r.end_ns
    FROM derive.executor_run AS r
    JOIN derive.executor_size AS s ON r.executor_id = s.executor_id
    WHERE s.thread_count = 1 AND r.end_ns > r.start_ns
)
SELECT
    run_id,
    executor_id,
    start_ns,
    end_ns,
    coalesce(sum(end_ns - start_ns) OVER (
        PARTITION BY run_id, executor_id ORDER BY start_ns
        ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
    ), 0)::BIGINT AS before_ns
FROM stretch
