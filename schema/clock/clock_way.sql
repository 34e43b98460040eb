-- description: What was sent on one clock and received on another, where this is known without
--     comparing the two: messages matched by their stamps where there is no other candidate,
--     service requests and responses, and network packets. A request or response may be reported
--     long after it was sent, if its thread lost the CPU in between. So its time of sending is
--     the time of something that certainly came before. For a request this is the begin of the
--     callback that sent it; requests that no callback sent do not count. For a response it is
--     the end of the service callback on the thread that sent it, else the begin of that
--     callback, or the take of the request.
-- grain: one row per message or packet between two clocks
WITH trace_clock AS (
    SELECT t.trace_id, h.clock_id
    FROM store.trace AS t
    JOIN store.host AS h ON t.host_id = h.host_id
),
thread_clock AS (
    SELECT t.thread_id, c.clock_id
    FROM store.thread AS t
    JOIN derive.process_clock AS c ON t.process_id = c.process_id
)
SELECT
    l.run_id,
    f.clock_id AS from_clock_id,
    o.clock_id AS to_clock_id,
    false AS is_packet,
    b.end_ns AS sent_ns,
    t.taken_ns AS received_ns
FROM store.link_transport AS l
JOIN store.publication AS b ON l.publication_id = b.publication_id
JOIN store.take AS t ON l.take_id = t.take_id
JOIN derive.process_clock AS f ON b.process_id = f.process_id
JOIN derive.process_clock AS o ON t.process_id = o.process_id
WHERE l.method IN ('exact', 'exact_stamp', 'nearest')
    AND l.candidate_count = 1
    AND f.clock_id <> o.clock_id
UNION ALL
SELECT q.run_id, f.clock_id, o.clock_id, false, i.start_ns, q.taken_ns
FROM store.request AS q
JOIN store.link_request AS l ON q.request_id = l.request_id
JOIN store.callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
JOIN thread_clock AS f ON q.sender_thread_id = f.thread_id
JOIN thread_clock AS o ON q.receiver_thread_id = o.thread_id
WHERE q.taken_ns IS NOT NULL AND f.clock_id <> o.clock_id
UNION ALL
SELECT
    r.run_id, f.clock_id, o.clock_id, false,
    CASE
        WHEN i.end_ns <= r.sent_ns AND i.thread_id = r.sender_thread_id THEN i.end_ns
        ELSE coalesce(i.start_ns, q.taken_ns)
    END,
    r.taken_ns
FROM store.response AS r
JOIN store.request AS q ON r.request_id = q.request_id
LEFT JOIN store.callback_instance AS i ON r.callback_instance_id = i.callback_instance_id
JOIN thread_clock AS f ON r.sender_thread_id = f.thread_id
JOIN thread_clock AS o ON r.receiver_thread_id = o.thread_id
WHERE r.taken_ns IS NOT NULL
    AND coalesce(i.start_ns, q.taken_ns) IS NOT NULL
    AND f.clock_id <> o.clock_id
UNION ALL
SELECT l.run_id, f.clock_id, o.clock_id, true, l.sent_ns, l.received_ns
FROM store.link_packet AS l
JOIN trace_clock AS f ON l.sent_trace_id = f.trace_id
JOIN trace_clock AS o ON l.received_trace_id = o.trace_id
