-- description: Threads that did not come back from a callback: the last one that they began has no
--     end, and nothing shows that its thread did anything else afterwards. A callback is left
--     out if a gap may hide its end, or if its process recorded no end of any callback. So is a job
--     of Python, which no executor waits for.
-- grain: one row per such thread
WITH last_run AS (
    SELECT
        run_id, process_id, thread_id,
        max(start_ns) AS start_ns,
        arg_max_null(
            CASE WHEN end_ns IS NULL AND NOT is_loss_affected THEN callback_instance_id END,
            start_event_id
        ) AS callback_instance_id,
        arg_max(callback_id, start_event_id) AS callback_id
    FROM store.callback_instance
    GROUP BY run_id, process_id, thread_id
)
SELECT l.run_id, l.process_id, l.thread_id, l.callback_instance_id, l.callback_id, l.start_ns
FROM last_run AS l
LEFT JOIN (
    SELECT
        thread_id,
        max(start_ns) AS start_ns
    FROM store.executor_state
    GROUP BY thread_id
) AS e ON l.thread_id = e.thread_id
JOIN store.callback AS c ON l.callback_id = c.callback_id
WHERE l.callback_instance_id IS NOT NULL
    AND coalesce(e.start_ns <= l.start_ns, c.kind <> 'function')
    AND l.process_id IN (
        SELECT process_id FROM store.callback_instance WHERE end_event_id IS NOT NULL
    )
