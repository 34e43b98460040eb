-- name: bar
-- description: Everything that one thread did and the timeline draws as a bar, at the times of its
--     own clock: by these the file finds a window without reading the rest, by corrected ones it
--     could not.
-- grain: one row per callback instance, publication, take and state of an executor
-- kind: inline
-- column: run_id BIGINT  Run
-- column: process_id BIGINT  Process, whose clock it is
-- column: row_key BIGINT  Row of the timeline, see row.sql
-- column: kind UTINYINT  0 callback instance, 1 publication, 2 take; states of an executor: 5 wait,
--     6 process, 7 execute
-- column: id BIGINT  Identity of the thing within its kind; of states the first callback instance
--     in it, -1: none
-- column: recorded_ns BIGINT  Begin
-- column: recorded_end_ns BIGINT  End; the begin where the end was not seen
-- column: flags UTINYINT  1: lost events may hide a part; 2: the end was not seen; 4: called with
--     an intra-process message; 8: nested in another callback instance
SELECT
    i.run_id,
    i.process_id,
    CASE c.kind
        WHEN 'timer' THEN coalesce(8 * c.timer_id, 8 * c.callback_id + 5)
        WHEN 'subscription' THEN coalesce(8 * c.subscription_id + 1, 8 * c.callback_id + 5)
        WHEN 'service' THEN coalesce(8 * c.service_id + 2, 8 * c.callback_id + 5)
        ELSE 8 * c.callback_id + 5
    END AS row_key,
    0::UTINYINT AS kind,
    i.callback_instance_id AS id,
    i.start_ns AS recorded_ns,
    coalesce(i.end_ns, i.start_ns) AS recorded_end_ns,
    (coalesce(i.is_loss_affected, false)::UTINYINT + 2 * (i.end_ns IS NULL)::UTINYINT
        + 4 * i.is_intra_process::UTINYINT + 8 * (i.depth > 1)::UTINYINT)::UTINYINT AS flags
FROM store.callback_instance AS i
JOIN store.callback AS c ON i.callback_id = c.callback_id
UNION ALL
SELECT
    run_id, process_id, coalesce(8 * publisher_id + 4, 8 * process_id + 7), 1, publication_id,
    start_ns, end_ns, coalesce(is_loss_affected, false)::UTINYINT
FROM store.publication
UNION ALL
SELECT
    run_id, process_id, coalesce(8 * subscription_id + 1, 8 * process_id + 7), 2, take_id,
    taken_ns, taken_ns, coalesce(is_loss_affected, false)::UTINYINT
FROM store.take
UNION ALL
SELECT
    s.run_id, t.process_id, 8 * s.thread_id + 6,
    CASE s.state WHEN 'wait' THEN 5 WHEN 'process' THEN 6 ELSE 7 END,
    coalesce(s.callback_instance_id, -1), s.start_ns, coalesce(s.end_ns, s.start_ns),
    (2 * (s.end_ns IS NULL)::UTINYINT)::UTINYINT
FROM store.executor_state AS s
JOIN store.thread AS t ON s.thread_id = t.thread_id
