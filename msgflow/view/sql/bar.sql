-- description: What the timeline draws as a bar: callback instances, publications, takes, requests
--     and responses of services, from sending to taking, what executor threads did, states of
--     threads to the kernel, states of managed nodes, and, without a length, events of the user's own tracepoints and messages that
--     were not taken. Threads have their states as recorded, but
--     for the time in which they are blocked: main.executor_activity would take far longer for a window.
--     Those of executors without states (events executors) have their callbacks; segment.sql has
--     their pauses.
-- grain: one row per bar
-- kind: inline
-- column: run_id
-- column: row_key BIGINT  Row of the timeline, see row.sql; of requests and responses that of the
--     client, else of the service, else of the process
-- column: kind UTINYINT  0 callback instance, 1 publication, 2 take, 3 request, 4 response; of
--     a thread of an executor: 5 wait, 6 select, 7 take and callback, 9 blocked; 8 event of the
--     user; of a managed node: 10 active, 11 not active; 12 message that a subscription did not take,
--     at the end of its publication; 13 to 18: see thread_bar.sql
-- column: id BIGINT  Identity of the thing within its kind; of threads the first callback instance
--     in it, of events the one inside which they happened, -1: none
-- column: start_ns
-- column: end_ns BIGINT [epoch ns]  End; the begin where the end was not seen
-- column: flags UTINYINT  1: lost events may hide a part; 2: an end was not seen; 4: called with
--     an intra-process message; 8: nested in another callback instance; 16: dropped, 32: lost, neither: not known
SELECT
    i.run_id, r.row_key,
    0::UTINYINT AS kind,
    i.callback_instance_id AS id,
    i.start_ns,
    coalesce(i.end_ns, i.start_ns) AS end_ns,
    (coalesce(i.is_loss_affected, false)::UTINYINT + 2 * (i.end_ns IS NULL)::UTINYINT
        + 4 * i.is_intra_process::UTINYINT + 8 * (i.depth > 1)::UTINYINT)::UTINYINT AS flags
FROM main.callback_instance AS i
JOIN callback_row AS r ON i.callback_id = r.callback_id
UNION ALL
SELECT
    run_id,
    coalesce(8 * publisher_id + 4, 8 * process_id + 7),
    1, publication_id, start_ns, end_ns,
    coalesce(is_loss_affected, false)::UTINYINT
FROM main.publication
UNION ALL
SELECT
    run_id,
    coalesce(8 * subscription_id + 1, 8 * process_id + 7),
    2, take_id, taken_ns, taken_ns,
    coalesce(is_loss_affected, false)::UTINYINT
FROM main.take
UNION ALL
SELECT
    q.run_id,
    coalesce(8 * q.client_id + 3, 8 * q.service_id + 2, 8 * t.process_id + 7),
    3, q.request_id,
    coalesce(q.sent_ns, q.taken_ns),
    coalesce(q.taken_ns, q.sent_ns),
    (2 * (q.taken_ns IS NULL OR q.sent_ns IS NULL)::UTINYINT)::UTINYINT
FROM main.request AS q
JOIN main.thread AS t ON coalesce(q.sender_thread_id, q.receiver_thread_id) = t.thread_id
UNION ALL
SELECT
    r.run_id,
    coalesce(8 * r.client_id + 3, 8 * r.service_id + 2, 8 * t.process_id + 7),
    4, r.response_id,
    coalesce(r.sent_ns, r.taken_ns),
    coalesce(r.taken_ns, r.sent_ns),
    (2 * (r.taken_ns IS NULL OR r.sent_ns IS NULL)::UTINYINT)::UTINYINT
FROM main.response AS r
JOIN main.thread AS t ON coalesce(r.receiver_thread_id, r.sender_thread_id) = t.thread_id
UNION ALL
SELECT
    s.run_id,
    8 * s.thread_id + 6,
    CASE s.state WHEN 'wait' THEN 5 WHEN 'execute' THEN 7 ELSE
        -- It looked in vain, and looks again when it has the lock.
        CASE WHEN s.next_state = 'process' AND e.kind LIKE 'multi_threaded%' THEN 9 ELSE 6 END END,
    coalesce(s.callback_instance_id, -1),
    s.start_ns,
    CASE WHEN s.state = 'execute' THEN least(coalesce(s.end_ns, s.start_ns), i.end_ns)
        ELSE coalesce(s.end_ns, s.start_ns) END,
    (2 * (s.end_ns IS NULL)::UTINYINT)::UTINYINT
FROM (
    SELECT
        run_id, executor_id, thread_id, state, start_ns, end_ns, callback_instance_id,
        lead(state) OVER (PARTITION BY thread_id ORDER BY start_ns) AS next_state
    FROM main.executor_state
) AS s
LEFT JOIN main.executor AS e ON s.executor_id = e.executor_id
LEFT JOIN main.callback_instance AS i ON s.callback_instance_id = i.callback_instance_id
UNION ALL
SELECT
    s.run_id,
    8 * s.thread_id + 6,
    CASE WHEN e.kind LIKE 'multi_threaded%' THEN 9 ELSE 6 END,
    s.callback_instance_id, i.end_ns, s.end_ns, 0
FROM main.executor_state AS s
JOIN main.executor AS e ON s.executor_id = e.executor_id
JOIN main.callback_instance AS i ON s.callback_instance_id = i.callback_instance_id
WHERE s.state = 'execute' AND i.end_ns < s.end_ns
UNION ALL
SELECT
    i.run_id,
    8 * i.thread_id + 6,
    7, i.callback_instance_id, i.start_ns,
    coalesce(i.end_ns, i.start_ns),
    (2 * (i.end_ns IS NULL)::UTINYINT)::UTINYINT
FROM main.callback_instance AS i
WHERE i.depth = 1
    AND i.thread_id IN (FROM main.executor_thread SELECT thread_id)
    AND i.thread_id NOT IN (FROM main.executor_state SELECT thread_id)
UNION ALL
SELECT
    u.run_id, r.row_key, 8,
    coalesce(u.callback_instance_id, -1),
    u.at_ns, u.at_ns,
    u.is_loss_affected::UTINYINT
FROM main.user_event AS u
LEFT JOIN main.callback_instance AS i ON u.callback_instance_id = i.callback_instance_id
LEFT JOIN main.callback AS c ON i.callback_id = c.callback_id
JOIN event_row AS r
    ON u.process_id = r.process_id AND c.node_id IS NOT DISTINCT FROM r.node_id AND u.name = r.name
UNION ALL
SELECT
    run_id,
    -4 * node_id - 1,
    CASE WHEN state = 'active' THEN 10 ELSE 11 END,
    -1, start_ns, end_ns, 0
FROM main.node_state
UNION ALL
SELECT
    d.run_id,
    8 * d.subscription_id + 1,
    12, d.publication_id, p.end_ns, p.end_ns,
    (CASE d.status WHEN 'dropped' THEN 16 WHEN 'lost' THEN 32 ELSE 0 END)::UTINYINT
FROM main.stat_delivery AS d
JOIN main.publication AS p ON d.publication_id = p.publication_id
WHERE d.status IN ('dropped', 'lost', 'unknown')
UNION ALL
SELECT run_id, row_key, kind, id, start_ns, end_ns, flags FROM thread_bar
