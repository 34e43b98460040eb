-- description: What executor threads did, as their three events say.
-- grain: one row per interval between two executor events of a thread
-- column: run_id, executor_id, thread_id, state, start_ns
-- column: end_ns BIGINT [epoch ns]  Next executor event of the thread; NULL: not known (the last,
--     a gap follows, or the recording leaves out events that end states)
-- column: callback_instance_id
SELECT
    s.run_id, s.executor_id, s.thread_id, s.state,
    derive.corrected_ns(s.start_ns, c) AS start_ns,
    derive.corrected_ns(s.end_ns, c) AS end_ns,
    s.callback_instance_id
FROM derive.executor_interval AS s
JOIN store.thread AS t ON s.thread_id = t.thread_id
JOIN derive.process_clock AS c ON t.process_id = c.process_id
