-- name: staging.thread_executor
-- description: Threads of the executors that name themselves. If a thread serves several of them,
--     it belongs to the one whose callbacks it ran most.
-- grain: one row per thread that ran callbacks of such an executor
-- when: staging.callback_group_entry WHERE executor_event_id IS NOT NULL
SELECT thread_id, executor_event_id
FROM (
    SELECT r.thread_id, s.executor_event_id, count(*) AS run_count
    FROM staging.callback_run AS r
    JOIN staging.callback_number AS n ON r.start_event_id = n.start_event_id
    JOIN staging.callback_group_entry AS s ON n.callback_id = s.callback_id
    WHERE r.depth = 1 AND s.executor_event_id IS NOT NULL
    GROUP BY r.thread_id, s.executor_event_id
)
QUALIFY row_number() OVER (PARTITION BY thread_id ORDER BY run_count DESC, executor_event_id) = 1
