-- description: All links in one shape, with the times of both ends: cause and effect of every step
--     that a message takes.
-- grain: one row per cause, effect and kind of link, however many annotations declare it
-- column: run_id BIGINT  Run that the row belongs to
-- column: from_kind VARCHAR  Cause: 'publication', 'take', 'callback_instance', 'request' or
--     'response'
-- column: from_id BIGINT  Identity of the cause
-- column: to_kind VARCHAR  Effect: one of these
-- column: to_id BIGINT  Identity of the effect
-- column: link_kind VARCHAR  'transport', 'callback', 'service' (from a request to its response),
--     or the kind of the causal link
-- column: from_ns BIGINT [epoch ns]  End of the publication, the take (also of a request or
--     response), or start of the callback instance
-- column: to_ns BIGINT [epoch ns]  Take, start of the callback instance or publication, or sending
--     of the request or response
SELECT
    l.run_id,
    'publication' AS from_kind,
    l.publication_id AS from_id,
    'take' AS to_kind,
    l.take_id AS to_id,
    'transport' AS link_kind,
    b.end_ns AS from_ns, t.taken_ns AS to_ns
FROM main.link_transport AS l
JOIN main.publication AS b ON l.publication_id = b.publication_id
JOIN main.take AS t ON l.take_id = t.take_id
WHERE NOT l.is_self_loop
UNION ALL
SELECT
    i.run_id,
    'take',
    t.take_id,
    'callback_instance',
    i.callback_instance_id,
    'callback',
    t.taken_ns, i.start_ns
FROM main.callback_instance AS i
JOIN main.take AS t ON i.take_id = t.take_id
UNION ALL
SELECT
    l.run_id,
    CASE WHEN l.callback_instance_id IS NULL THEN 'take' ELSE 'callback_instance' END,
    coalesce(l.callback_instance_id, l.take_id),
    'publication',
    l.publication_id, l.kind,
    coalesce(i.start_ns, t.taken_ns),
    b.start_ns
FROM derive.flow_cause AS l
LEFT JOIN main.callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
LEFT JOIN main.take AS t ON l.callback_instance_id IS NULL AND l.take_id = t.take_id
JOIN main.publication AS b ON l.publication_id = b.publication_id
UNION ALL
SELECT
    l.run_id,
    'callback_instance',
    l.callback_instance_id,
    'request',
    l.request_id,
    'direct',
    i.start_ns, q.sent_ns
FROM derive.certain_request AS l
JOIN main.callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
JOIN main.request AS q ON l.request_id = q.request_id
UNION ALL
SELECT
    i.run_id,
    'request',
    q.request_id,
    'callback_instance',
    i.callback_instance_id,
    'callback',
    q.taken_ns, i.start_ns
FROM main.callback_instance AS i
JOIN main.request AS q ON i.request_id = q.request_id
UNION ALL
SELECT
    l.run_id,
    'callback_instance',
    l.callback_instance_id,
    'response',
    l.response_id,
    CASE WHEN l.callback_instance_id = r.callback_instance_id THEN 'service' ELSE 'direct' END,
    i.start_ns,
    coalesce(r.sent_ns, r.taken_ns)
FROM main.link_response AS l
JOIN main.callback_instance AS i ON l.callback_instance_id = i.callback_instance_id
JOIN main.response AS r ON l.response_id = r.response_id
UNION ALL
SELECT
    r.run_id,
    'request',
    q.request_id,
    'response',
    r.response_id,
    'service',
    coalesce(q.taken_ns, q.sent_ns),
    coalesce(r.sent_ns, r.taken_ns)
FROM main.response AS r
JOIN main.request AS q ON r.request_id = q.request_id
WHERE r.callback_instance_id IS NULL
UNION ALL
SELECT
    l.run_id, l.from_kind, l.from_id, l.to_kind, l.to_id,
    'take_adjacent',
    coalesce(tq.taken_ns, tr.taken_ns),
    coalesce(b.start_ns, q.sent_ns, r.sent_ns)
FROM derive.certain_call AS l
LEFT JOIN main.request AS tq ON l.taken_request_id = tq.request_id
LEFT JOIN main.response AS tr ON l.taken_response_id = tr.response_id
LEFT JOIN main.publication AS b ON l.publication_id = b.publication_id
LEFT JOIN main.request AS q ON l.request_id = q.request_id
LEFT JOIN main.response AS r ON l.response_id = r.response_id
