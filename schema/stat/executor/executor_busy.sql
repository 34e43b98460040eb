-- description: Stretches of time in which no thread of an executor was free to start a callback:
--     all of them ran one. `before_ns` is the sum of the earlier stretches.
-- grain: one row per such stretch
WITH run AS (
    SELECT
        r.executor_id,
        NULL::BIGINT AS callback_id,
        r.start_ns, r.end_ns,
        s.thread_count AS enough
    FROM derive.executor_run AS r
    JOIN derive.executor_size AS s ON r.executor_id = s.executor_id
)
SELECT
    executor_id,
    enough AS thread_count,
    start_ns, end_ns, before_ns
FROM derive.concurrency('run')
