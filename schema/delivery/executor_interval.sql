-- description: What executor threads did, as their three events say: a state lasts until the next
--     such event of the thread. The last one of a thread, or before a gap, has no end. Nor has any
--     where the recording leaves out events that would end it. Times are by the clock of the
--     executor.
-- grain: one row per executor event of a thread
SELECT
    s.run_id, x.executor_id, s.thread_id, s.state, s.start_ns,
    lead(CASE WHEN NOT s.is_behind_gap AND d.run_id IS NOT NULL THEN s.start_ns END)
        OVER of_thread AS end_ns,
    s.callback_instance_id, s.start_event_id
FROM store.executor_state AS s
LEFT JOIN store.executor_thread AS x ON s.thread_id = x.thread_id
LEFT JOIN derive.delimited_run AS d ON s.run_id = d.run_id
WINDOW of_thread AS (PARTITION BY s.run_id, s.thread_id ORDER BY s.start_event_id)
