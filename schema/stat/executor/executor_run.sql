-- description: The callback instances that occupied threads of executors, numbered on each thread
--     in order of time. A callback instance that is nested in another is part of that one, so the
--     rows of a thread never overlap. Times are those of the executor's clock.
-- grain: one row per callback instance that is not nested in another
SELECT
    i.run_id, x.executor_id, i.thread_id, i.callback_id, i.callback_instance_id, i.start_ns,
    coalesce(i.end_ns, i.start_ns) AS end_ns,
    row_number() OVER (
        PARTITION BY i.run_id, i.thread_id ORDER BY i.start_ns, i.callback_instance_id
    ) AS position
FROM store.callback_instance AS i
JOIN store.executor_thread AS x ON i.thread_id = x.thread_id
WHERE i.depth = 1
