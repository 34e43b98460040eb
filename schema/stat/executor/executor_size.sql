-- description: How many threads an executor was seen to have.
-- grain: one row per executor
SELECT
    run_id, executor_id,
    count(*) AS thread_count
FROM store.executor_thread
GROUP BY run_id, executor_id
