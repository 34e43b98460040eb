-- description: What vertices of the graph of flows are: when and where each was, what it is called,
--     and what the trace does not show of it.
-- grain: one row per vertex
-- param: vertices VARCHAR  Name of a table, or a part of the query, with the key, kind, id and
--     depth of each
-- column: key BIGINT  Its key
-- column: kind
-- column: id BIGINT  Its identity
-- column: depth INTEGER  Its depth
-- column: run_id
-- column: start_ns BIGINT [epoch ns]  Start of the publication or callback instance; the take; the
--     sending of the request or response (the taking, if only that is known)
-- column: end_ns BIGINT [epoch ns]  Its end; when the request or response was taken
-- column: thread_id
-- column: process_id BIGINT  Its process
-- column: node VARCHAR  Node, or process in brackets; for requests and responses the client's node;
--     ? if it is not known
-- column: label, topic_name
-- column: symbol VARCHAR  Function of the callback
-- column: missing VARCHAR  What the trace does not show here, as in main.flow_step
-- column: reason VARCHAR  Why it is missing, as far as known
CREATE OR REPLACE MACRO main.flow_vertex(vertices) AS TABLE
SELECT
    v.key, v.kind, v.id, v.depth, b.run_id, b.start_ns, b.end_ns, b.thread_id, b.process_id,
    main.node_label(n.full_name, o.name, o.pid) AS node,
    coalesce(p.topic_name, '?') AS label,
    p.topic_name,
    NULL::VARCHAR AS symbol,
    NULL::VARCHAR AS missing,
    NULL::VARCHAR AS reason
FROM query_table(vertices) AS v
JOIN main.publication AS b ON v.id = b.publication_id
JOIN store.process AS o ON b.process_id = o.process_id
LEFT JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
LEFT JOIN store.node AS n ON p.node_id = n.node_id
WHERE v.kind = 'publication'
UNION ALL
SELECT
    v.key, v.kind, v.id, v.depth, t.run_id, t.taken_ns, t.taken_ns, t.thread_id, t.process_id,
    main.node_label(n.full_name, o.name, o.pid),
    coalesce(s.topic_name, '?'),
    s.topic_name, NULL,
    CASE
        WHEN x.id IS NOT NULL THEN 'publication'
        WHEN i.take_id IS NULL AND y.take_id IS NULL AND z.take_id IS NOT NULL THEN 'copy'
        WHEN i.take_id IS NULL AND y.take_id IS NULL THEN 'callback'
    END,
    x.reason
FROM query_table(vertices) AS v
JOIN main.take AS t ON v.id = t.take_id
JOIN store.process AS o ON t.process_id = o.process_id
LEFT JOIN store.subscription AS s ON t.subscription_id = s.subscription_id
LEFT JOIN store.node AS n ON s.node_id = n.node_id
LEFT JOIN derive.flow_end AS x ON x.kind = 'take' AND t.take_id = x.id
LEFT JOIN store.callback_instance AS i ON t.take_id = i.take_id
LEFT JOIN (
    SELECT DISTINCT take_id FROM derive.certain_cause WHERE kind IN ('take_adjacent', 'polled')
) AS y
    ON t.take_id = y.take_id
LEFT JOIN (
    SELECT DISTINCT l.take_id
    FROM store.link_transport AS l
    JOIN store.link_transport AS b
        ON l.publication_id = b.publication_id AND l.subscription_id = b.subscription_id
    WHERE l.method <> 'ring_buffer' AND b.method = 'ring_buffer'
) AS z
    ON t.take_id = z.take_id
WHERE v.kind = 'take'
UNION ALL
SELECT
    v.key, v.kind, v.id, v.depth, i.run_id, i.start_ns, i.end_ns, i.thread_id,
    i.process_id, c.node, c.label, s.topic_name, k.symbol,
    CASE
        WHEN k.kind = 'subscription' AND i.take_id IS NULL THEN 'take'
        WHEN i.end_ns IS NULL THEN 'end'
    END,
    NULL
FROM query_table(vertices) AS v
JOIN main.callback_instance AS i ON v.id = i.callback_instance_id
JOIN store.callback AS k ON i.callback_id = k.callback_id
JOIN main.callback_label AS c ON i.callback_id = c.callback_id
LEFT JOIN store.subscription AS s ON k.subscription_id = s.subscription_id
WHERE v.kind = 'callback_instance'
UNION ALL
SELECT
    v.key, v.kind, v.id, v.depth, q.run_id,
    coalesce(q.sent_ns, q.taken_ns),
    q.taken_ns, q.thread_id, h.process_id,
    CASE WHEN c.client_id IS NULL THEN '?' ELSE main.node_label(n.full_name, o.name, o.pid) END,
    coalesce(c.service_name, s.service_name, '?'),
    NULL, NULL,
    CASE
        WHEN q.sent_ns IS NULL THEN 'sending'
        WHEN q.taken_ns IS NULL THEN 'take'
        ELSE q.missing
    END,
    NULL
FROM query_table(vertices) AS v
JOIN (
    -- A message of a service is on the thread of the client, if that is known.
    SELECT
        'request' AS kind,
        q.request_id AS id,
        q.run_id, q.sent_ns, q.taken_ns,
        coalesce(q.sender_thread_id, q.receiver_thread_id) AS thread_id,
        q.client_id, q.service_id,
        CASE
            WHEN q.callback_instance_id IS NULL AND l.taken_request_id IS NULL THEN 'callback'
            WHEN r.request_id IS NULL THEN 'response'
        END AS missing
    FROM main.request AS q
    LEFT JOIN (SELECT DISTINCT request_id FROM store.response) AS r
        ON q.request_id = r.request_id
    LEFT JOIN (SELECT DISTINCT taken_request_id FROM derive.certain_call) AS l
        ON q.request_id = l.taken_request_id
    UNION ALL
    SELECT
        'response', response_id, run_id, sent_ns, taken_ns,
        coalesce(receiver_thread_id, sender_thread_id),
        client_id, service_id, NULL
    FROM main.response
) AS q ON v.kind = q.kind AND v.id = q.id
JOIN store.thread AS h ON q.thread_id = h.thread_id
LEFT JOIN store.client AS c ON q.client_id = c.client_id
LEFT JOIN store.service AS s ON q.service_id = s.service_id
LEFT JOIN store.process AS o ON c.process_id = o.process_id
LEFT JOIN store.node AS n ON c.node_id = n.node_id
