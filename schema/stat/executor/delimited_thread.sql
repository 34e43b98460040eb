-- name: derive.delimited_thread
-- description: Threads of processes that recorded both events between which executors wait: that
--     they wait, and that they look for work. Where the recording leaves out one of them, the next
--     event of a thread does not show how long its state lasted.
-- grain: one row per thread of such a process
SELECT t.thread_id
FROM store.thread AS t
WHERE t.process_id IN (
        SELECT process_id
        FROM store.thread
        WHERE thread_id IN (SELECT thread_id FROM store.executor_state WHERE state = 'wait')
    )
    AND t.process_id IN (
        SELECT process_id
        FROM store.thread
        WHERE thread_id IN (SELECT thread_id FROM store.executor_state WHERE state = 'process')
    )
