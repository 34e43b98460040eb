-- name: main.executor_activity
-- description: What executor threads did, in detail: their states, split where a callback begins
--     and ends and where a message is taken. Before its callback, an executing thread takes the
--     message (for a timer there is none: it is still selecting). After the callback, a thread of a
--     multi-threaded executor is blocked until it may look for work again. If callbacks are nested,
--     the innermost counts; inside a callback that spins, what it does there. Threads whose
--     executor has no events have callbacks, services and takes only. A callback without an end
--     lasts until the first event that cannot be inside it. Activities of a thread never overlap,
--     add up to its states, and never reach across a gap.
-- grain: one row per interval of a thread in which nothing changed
-- column: run_id BIGINT  Run that the row belongs to
-- column: executor_id BIGINT  Executor
-- column: thread_id BIGINT  Thread it happened on
-- column: activity VARCHAR  'wait', 'select', 'take', 'callback', 'service' or 'blocked'
-- column: start_ns BIGINT [epoch ns]  Begin
-- column: end_ns BIGINT [epoch ns]  End; NULL: not known (the last, or a gap follows)
-- column: callback_instance_id BIGINT  Innermost callback that ran
SELECT
    a.run_id,
    a.executor_id,
    a.thread_id,
    a.activity,
    derive.corrected_ns(a.start_ns, p.offset_ns, p.drift_ppb, p.reference_ns) AS start_ns,
    derive.corrected_ns(a.end_ns, p.offset_ns, p.drift_ppb, p.reference_ns) AS end_ns,
    a.callback_instance_id
FROM derive.thread_activity AS a
JOIN store.thread AS t ON a.thread_id = t.thread_id
JOIN derive.process_clock AS p ON t.process_id = p.process_id
