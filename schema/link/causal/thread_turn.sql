-- description: When a thread turns to something else, as far as executors and callbacks show it: a
--     state of the executor begins, a callback begins or ends.
-- grain: one row per thread and such moment
SELECT
    run_id, thread_id,
    start_ns AS at_ns
FROM store.executor_state
UNION ALL
SELECT
    run_id, thread_id,
    unnest([start_ns, end_ns])
FROM store.callback_instance
