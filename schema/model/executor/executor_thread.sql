-- description: Threads of the executors.
-- grain: one row per thread of an executor
-- when: staging.executor
SELECT
    executor_id,
    unnest(thread_ids) AS thread_id
FROM staging.executor
ORDER BY thread_id
