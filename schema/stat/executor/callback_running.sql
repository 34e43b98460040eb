-- description: Stretches of time in which at least one thread of an executor with several threads
--     ran a callback. `before_ns` is the sum of the earlier stretches of the callback.
-- grain: one row per such stretch
WITH run AS (
    SELECT r.executor_id, r.callback_id, r.start_ns, r.end_ns, 1 AS enough
    FROM derive.executor_run AS r
    JOIN derive.executor_size AS s ON r.executor_id = s.executor_id
    WHERE s.thread_count > 1
)
SELECT executor_id, callback_id, start_ns, end_ns, before_ns
FROM derive.concurrency('run')
