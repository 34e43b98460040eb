-- description: Threads of the executors.
-- grain: one row per thread of an executor
-- when: staging.executor_member
SELECT e.executor_id, m.thread_id
FROM staging.executor_member AS m
JOIN staging.executor AS e ON m.first_thread_id = e.first_thread_id
ORDER BY m.thread_id
