-- description: The picture of one message: what a publication, take, callback instance, request or
--     response caused, what it was caused by, or both, with times, names, and what is missing. If a
--     limit cuts the flow, the vertices nearest to the start are kept.
-- grain: one row per vertex of the flow and link that leads to it (one without link where nothing
--     does), and one per subscription that did not get a message
-- param: start_kind, start_id, direction
-- param: max_depth INTEGER = 96  Maximum number of steps from the start; a message takes three
-- param: max_vertices INTEGER = 1000  Maximum number of vertices
-- param: internal BOOLEAN = false  Follow effects on ROS's own topics and services too
-- column: run_id
-- column: depth INTEGER  Steps from the start; negative: backward
-- column: from_kind VARCHAR  Cause that the link comes from, as kind
-- column: from_id
-- column: link_kind VARCHAR  'transport', 'callback', 'service' or the kind of the causal link; to
--     a subscription that did not take the message: its status there, as in main.stat_delivery
-- column: wait_ns BIGINT [ns]  Time between cause and effect; NULL where the effect is part of the
--     cause
-- column: candidate_count BIGINT  Number of causes that are possible
-- column: is_loss_affected BOOLEAN  A gap of the trace may hide a better partner
-- column: kind VARCHAR  'publication', 'take', 'callback_instance', 'request', 'response', or
--     'subscription' where the message was not taken
-- column: id
-- column: start_ns BIGINT [epoch ns]  Start of the publication or callback instance; the take; the
--     sending of the request or response (the taking, if only that is known)
-- column: end_ns BIGINT [epoch ns]  Its end; when the request or response was taken
-- column: node VARCHAR  Node, or process in brackets; for requests and responses the client's node;
--     ? if it is not known
-- column: label, topic_name
-- column: symbol VARCHAR  Function of the callback
-- column: thread VARCHAR  Name and id of the thread
-- column: host
-- column: missing VARCHAR  What the trace does not show: 'publication' that was taken, 'take' of
--     the message, 'callback' it was taken for, 'sending' of the request or response, 'response' to
--     the request, 'end' of the callback instance; 'copy': nothing, it is the middleware's copy of
--     a message of a ring buffer
-- column: reason VARCHAR  Why it is missing, as far as known
-- column: cut_count BIGINT  Links that lead on from here beyond the limits
-- column: internal_count BIGINT  Effects on ROS's own topics and services that are left out
CREATE OR REPLACE MACRO main.flow_step(
    start_kind, start_id, direction := 'both', max_depth := 96, max_vertices := 1000,
    internal := false
) AS TABLE
WITH RECURSIVE origin AS MATERIALIZED (
    SELECT run_id FROM store.publication
    WHERE start_kind = 'publication' AND publication_id = start_id
    UNION ALL
    SELECT run_id FROM store.take WHERE start_kind = 'take' AND take_id = start_id
    UNION ALL
    SELECT run_id FROM store.callback_instance
    WHERE start_kind = 'callback_instance' AND callback_instance_id = start_id
    UNION ALL
    SELECT run_id FROM store.request WHERE start_kind = 'request' AND request_id = start_id
    UNION ALL
    SELECT run_id FROM store.response WHERE start_kind = 'response' AND response_id = start_id
),
-- Effects on ROS's own topics and services: no branches of the picture.
aside AS MATERIALIZED (
    SELECT
        CASE WHEN l.callback_instance_id IS NULL THEN derive.vertex_key('take', l.take_id)
            ELSE derive.vertex_key('callback_instance', l.callback_instance_id) END AS from_key,
        derive.vertex_key('publication', l.publication_id) AS key
    FROM derive.certain_cause AS l
    JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
    WHERE p.is_internal AND NOT internal AND l.run_id IN (SELECT run_id FROM origin)
    UNION ALL
    SELECT
        derive.vertex_key('callback_instance', l.callback_instance_id),
        derive.vertex_key('request', l.request_id)
    FROM derive.certain_request AS l
    JOIN store.request AS q ON l.request_id = q.request_id
    JOIN store.client AS c ON q.client_id = c.client_id
    WHERE c.is_internal AND NOT internal AND l.run_id IN (SELECT run_id FROM origin)
    UNION ALL
    SELECT
        derive.vertex_key(l.from_kind, l.from_id),
        derive.vertex_key(l.to_kind, l.to_id)
    FROM derive.certain_call AS l
    LEFT JOIN store.publisher AS p ON l.publisher_id = p.publisher_id
    LEFT JOIN store.request AS q ON l.request_id = q.request_id
    LEFT JOIN store.client AS c ON q.client_id = c.client_id
    WHERE (p.is_internal OR c.is_internal)
        AND NOT internal
        AND l.run_id IN (SELECT run_id FROM origin)
),
link AS (
    SELECT
        derive.vertex_key(from_kind, from_id) AS from_key,
        derive.vertex_key(to_kind, to_id) AS to_key
    FROM derive.flow_link
    WHERE run_id IN (SELECT run_id FROM origin)
),
edge AS MATERIALIZED (
    SELECT
        false AS is_backward,
        l.from_key, l.to_key
    FROM link AS l
    ANTI JOIN aside AS a ON l.to_key = a.key
    WHERE direction <> 'backward'
    UNION ALL
    SELECT true, to_key, from_key FROM link WHERE direction <> 'forward'
),
near (is_backward, key, depth) USING KEY (is_backward, key) AS (
    SELECT
        s.is_backward,
        derive.vertex_key(start_kind, start_id)::BIGINT,
        0
    FROM (VALUES (false), (true)) AS s (is_backward)
    CROSS JOIN origin AS o
    UNION
    SELECT
        n.is_backward, e.to_key,
        min(n.depth) + 1
    FROM near AS n
    JOIN edge AS e ON n.is_backward = e.is_backward AND n.key = e.from_key
    ANTI JOIN recurring.near AS k ON n.is_backward = k.is_backward AND e.to_key = k.key
    WHERE n.depth < max_depth AND (SELECT count(*) FROM recurring.near) <= max_vertices
    GROUP BY n.is_backward, e.to_key
),
-- The same vertex may come twice, as effect and as cause: the start, and in rings others.
vertex AS MATERIALIZED (
    SELECT
        key,
        derive.vertex_kind(key) AS kind,
        key // 8 AS id,
        CASE WHEN bool_and(is_backward) THEN -min(depth) ELSE min(depth) END::INTEGER AS depth
    FROM near
    GROUP BY key
    ORDER BY min(depth), bool_and(is_backward), kind, id
    LIMIT max_vertices::BIGINT
),
shown AS MATERIALIZED (
    SELECT n.is_backward, v.key, v.kind, v.id
    FROM near AS n
    JOIN vertex AS v ON n.key = v.key
    WHERE direction = 'both' OR n.is_backward = (direction = 'backward')
),
cut AS (
    SELECT
        s.key,
        count(*) AS cut_count
    FROM shown AS s
    JOIN edge AS e ON s.is_backward = e.is_backward AND s.key = e.from_key
    ANTI JOIN vertex AS v ON e.to_key = v.key
    GROUP BY s.key
),
left_out AS (
    SELECT
        s.key,
        count(*) AS internal_count
    FROM aside AS a
    JOIN shown AS s ON a.from_key = s.key
    ANTI JOIN vertex AS v ON a.key = v.key
    WHERE NOT s.is_backward
    GROUP BY s.key
),
described AS MATERIALIZED (FROM main.flow_vertex('vertex')),
arrow AS MATERIALIZED (
    SELECT
        l.from_kind, l.from_id, l.link_kind, l.to_id,
        derive.vertex_key(l.from_kind, l.from_id) AS from_key,
        derive.vertex_key(l.to_kind, l.to_id) AS to_key
    FROM derive.flow_link AS l
    JOIN vertex AS f ON l.from_kind = f.kind AND l.from_id = f.id
    JOIN vertex AS t ON l.to_kind = t.kind AND l.to_id = t.id
)
SELECT
    d.run_id, d.depth, a.from_kind, a.from_id, a.link_kind,
    CASE
        WHEN a.link_kind IN ('transport', 'callback', 'take_adjacent', 'polled')
            OR derive.is_indirect(a.link_kind)
            THEN d.start_ns - f.end_ns
        WHEN a.link_kind = 'service' AND d.start_ns >= f.end_ns THEN d.start_ns - f.end_ns
    END AS wait_ns,
    coalesce(
        lt.candidate_count, lc.candidate_count,
        -- What follows from a request or response is followed only if it is certain.
        CASE WHEN a.link_kind = 'take_adjacent' THEN 1 END
    ) AS candidate_count,
    coalesce(lt.is_loss_affected, lc.is_loss_affected) AS is_loss_affected,
    d.kind, d.id, d.start_ns, d.end_ns, d.node, d.label, d.topic_name, d.symbol,
    printf('%s %d', coalesce(h.name, '?'), h.tid) AS thread,
    m.hostname AS host,
    d.missing, d.reason,
    coalesce(c.cut_count, 0) AS cut_count,
    coalesce(o.internal_count, 0) AS internal_count
FROM described AS d
LEFT JOIN arrow AS a ON d.key = a.to_key
LEFT JOIN described AS f ON a.from_key = f.key
LEFT JOIN store.link_transport AS lt
    ON a.link_kind = 'transport' AND a.to_id = lt.take_id AND a.from_id = lt.publication_id
LEFT JOIN derive.flow_cause AS lc
    ON a.from_kind
        = CASE WHEN lc.callback_instance_id IS NULL THEN 'take' ELSE 'callback_instance' END
    AND a.from_id = coalesce(lc.callback_instance_id, lc.take_id)
    AND a.to_id = lc.publication_id
    AND a.link_kind = lc.kind
LEFT JOIN store.thread AS h ON d.thread_id = h.thread_id
JOIN store.process AS q ON d.process_id = q.process_id
JOIN store.host AS m ON q.host_id = m.host_id
LEFT JOIN cut AS c ON d.key = c.key
LEFT JOIN left_out AS o ON d.key = o.key
UNION ALL
SELECT
    x.run_id,
    d.depth + 1,
    d.kind, d.id,
    derive.delivery_status(x.reason),
    NULL, NULL, NULL,
    'subscription',
    x.subscription_id, NULL, NULL,
    main.node_label(n.full_name, o.name, o.pid),
    coalesce(s.topic_name, '?'),
    s.topic_name, NULL, NULL, m.hostname,
    'take',
    x.reason, 0, 0
FROM shown AS v
JOIN described AS d ON v.key = d.key
JOIN derive.flow_end AS x ON x.kind = 'publication' AND v.id = x.id
JOIN store.subscription AS s ON x.subscription_id = s.subscription_id
JOIN store.process AS o ON s.process_id = o.process_id
JOIN store.host AS m ON o.host_id = m.host_id
LEFT JOIN store.node AS n ON s.node_id = n.node_id
WHERE v.kind = 'publication' AND NOT v.is_backward
