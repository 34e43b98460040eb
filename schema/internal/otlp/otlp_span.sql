-- description: Callback instances, publications, takes, requests and responses as spans. What
--     caused a thing is its parent; of several causes that is the callback that it happened in, or
--     else the latest. The others are links. A trace is a span without a parent and all that
--     descends from it. ROS's own topics and services are left out. A resource and a span are as
--     OTLP/JSON has them: 64-bit integers are text there, ids are hexadecimal. Attributes are those
--     of the conventions for messaging, remote calls, threads and code; what these have no word for
--     begins with 'msgflow.'.
-- grain: one row per span
-- param: start_ns BIGINT  Begin of the window, epoch ns; does not count where keys are given
-- param: end_ns BIGINT  End of the window, epoch ns, likewise
-- param: keys BIGINT[] = NULL  Only these vertices, those of flows; NULL: all that begins in the
--     window
-- param: run_name VARCHAR  Name of the run
-- param: identity VARCHAR = ''  What tells the run from others; ids are computed from it
WITH RECURSIVE place AS (
    SELECT
        i.run_id, l.is_internal,
        'callback_instance' AS kind,
        i.callback_instance_id AS id,
        i.start_ns AS at_ns
    FROM main.callback_instance AS i
    JOIN main.callback_label AS l ON i.callback_id = l.callback_id
    UNION ALL
    SELECT b.run_id, p.is_internal, 'publication', b.publication_id, b.start_ns
    FROM main.publication AS b
    LEFT JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
    UNION ALL
    SELECT t.run_id, s.is_internal, 'take', t.take_id, t.taken_ns
    FROM main.take AS t
    LEFT JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
    UNION ALL
    SELECT
        q.run_id,
        coalesce(c.is_internal, s.is_internal),
        q.kind, q.id,
        coalesce(q.sent_ns, q.taken_ns)
    FROM (
        SELECT
            run_id,
            'request' AS kind,
            request_id AS id,
            sent_ns, taken_ns, client_id, service_id
        FROM main.request
        UNION ALL
        SELECT run_id, 'response', response_id, sent_ns, taken_ns, client_id, service_id
        FROM main.response
    ) AS q
    LEFT JOIN main.client AS c ON q.client_id = c.client_id
    LEFT JOIN main.service AS s ON q.service_id = s.service_id
),
otlp_vertex AS MATERIALIZED (
    SELECT
        derive.vertex_key(kind, id)::BIGINT AS key,
        kind, id, 0 AS depth
    FROM place
    WHERE run_id = $run_id AND is_internal IS NOT true
        AND CASE WHEN $keys IS NULL THEN at_ns >= $start_ns AND at_ns < $end_ns
            ELSE list_contains($keys, derive.vertex_key(kind, id)) END
),
described AS MATERIALIZED (
    SELECT
        key, kind, id, start_ns,
        greatest(coalesce(end_ns, start_ns), start_ns) AS end_ns,
        thread_id, process_id, node, label, topic_name, symbol
    FROM main.flow_vertex('otlp_vertex')
),
link AS MATERIALIZED (
    SELECT
        l.from_key, l.to_key, l.link_kind,
        f.end_ns AS caused_ns
    FROM (
        SELECT
            derive.vertex_key(from_kind, from_id)::BIGINT AS from_key,
            derive.vertex_key(to_kind, to_id)::BIGINT AS to_key,
            link_kind
        FROM derive.flow_link
        WHERE run_id = $run_id
    ) AS l
    JOIN described AS f ON l.from_key = f.key
    SEMI JOIN described AS t ON l.to_key = t.key
),
-- A flow that waited in a cache goes on in the callback that published for it. Without chosen flows
-- that would make one trace of a whole run: a loop of control always finds its own message there.
caused AS (
    SELECT from_key, to_key, link_kind, caused_ns FROM link
    UNION ALL
    SELECT i.from_key, d.from_key, i.link_kind, i.caused_ns
    FROM link AS i
    JOIN link AS d ON i.to_key = d.to_key AND d.link_kind = 'direct' AND i.from_key <> d.from_key
    WHERE $keys IS NOT NULL AND derive.is_indirect(i.link_kind)
),
cause AS MATERIALIZED (
    SELECT
        to_key AS key,
        from_key AS cause_key,
        min(link_kind) AS link_kind,
        row_number() OVER (
            PARTITION BY to_key
            ORDER BY bool_and(derive.is_indirect(link_kind)), max(caused_ns) DESC, from_key
        ) AS place
    FROM caused
    GROUP BY to_key, from_key
),
-- Each step doubles how far up a vertex has looked: 64 of them reach any root.
ancestor (key, root_key, step) USING KEY (key) AS (
    SELECT
        d.key,
        coalesce(c.cause_key, d.key),
        0
    FROM described AS d
    LEFT JOIN cause AS c ON d.key = c.key AND c.place = 1
    UNION
    SELECT
        a.key, b.root_key,
        a.step + 1
    FROM ancestor AS a
    JOIN recurring.ancestor AS b ON a.root_key = b.key
    WHERE a.root_key <> b.root_key AND a.step < 64
),
root AS MATERIALIZED (
    SELECT
        key, root_key,
        md5(concat($identity, ' trace ', root_key)) AS trace_id,
        left(md5(concat($identity, ' span ', key)), 16) AS span_id
    FROM ancestor
),
further AS (
    SELECT
        c.key,
        list(
            {
                'traceId': r.trace_id,
                'spanId': r.span_id,
                'attributes': [{'key': 'msgflow.link', 'value': {'stringValue': c.link_kind}}]
            }
            ORDER BY c.place
        ) AS links
    FROM cause AS c
    JOIN root AS r ON c.cause_key = r.key
    WHERE c.place > 1
    GROUP BY c.key
),
fate AS (
    SELECT
        y.publication_id,
        string_agg(
            concat(y.status, ' at ', main.node_label(n.full_name, p.name, p.pid), ': ', y.reason),
            ', ' ORDER BY y.subscription_id
        ) AS not_delivered
    FROM main.stat_delivery AS y
    JOIN main.subscription AS s ON y.subscription_id = s.subscription_id
    JOIN main.process AS p ON s.process_id = p.process_id
    LEFT JOIN main.node AS n ON s.node_id = n.node_id
    WHERE y.run_id = $run_id AND y.status IN ('dropped', 'lost')
    GROUP BY y.publication_id
),
span AS (
    SELECT
        d.key, r.root_key, r.trace_id, r.span_id, d.kind, d.id, d.start_ns, d.end_ns, c.cause_key,
        c.link_kind, d.thread_id, d.process_id, d.node, d.topic_name, d.symbol,
        k.kind AS trigger,
        d.label,
        CASE WHEN k.kind = 'service' THEN v.service_name
            WHEN d.kind IN ('request', 'response') THEN d.label END AS service
    FROM described AS d
    JOIN root AS r ON d.key = r.key
    LEFT JOIN cause AS c ON d.key = c.key AND c.place = 1
    LEFT JOIN main.callback_instance AS i
        ON d.kind = 'callback_instance' AND d.id = i.callback_instance_id
    LEFT JOIN main.callback AS k ON i.callback_id = k.callback_id
    LEFT JOIN main.service AS v ON k.service_id = v.service_id
)
SELECT
    s.kind, s.id,
    CASE WHEN s.kind = 'take' THEN least(coalesce(u.end_ns, s.start_ns), s.start_ns)
        ELSE s.start_ns END AS from_ns,
    greatest(s.end_ns, from_ns + 1) AS to_ns,
    CASE
        WHEN s.kind = 'publication' THEN 'send'
        WHEN s.kind = 'take' THEN 'receive'
        WHEN s.kind = 'callback_instance' AND s.topic_name IS NOT NULL THEN 'process'
    END AS operation,
    {
        'service.name': s.node,
        'host.name': h.hostname,
        'process.pid': e.pid,
        'process.executable.name': e.name,
        'msgflow.run': $run_name
    } AS resource,
    {
        'traceId': s.trace_id,
        'spanId': s.span_id,
        'parentSpanId': coalesce(p.span_id, ''),
        'name': CASE
            WHEN s.kind = 'publication' THEN 'publish ' || s.label
            WHEN s.kind = 'callback_instance' AND s.trigger <> 'subscription' THEN s.label
            WHEN s.kind = 'callback_instance' THEN 'process ' || coalesce(s.topic_name, '?')
            ELSE s.kind || ' ' || s.label
        END,
        'kind': CASE
            WHEN s.kind = 'publication' THEN 4
            WHEN s.kind = 'take' OR s.trigger = 'subscription' THEN 5
            WHEN s.kind = 'request' THEN 3
            WHEN s.trigger = 'service' THEN 2
            ELSE 1
        END,
        'startTimeUnixNano': from_ns::VARCHAR,
        'endTimeUnixNano': to_ns::VARCHAR,
        'links': coalesce(w.links, []),
        'status': {
            'code': CASE WHEN f.not_delivered IS NULL THEN 0 ELSE 2 END,
            'message': coalesce(f.not_delivered, '')
        }
    } AS span,
    {
        'messaging.system': CASE WHEN operation IS NOT NULL THEN 'ros2' END,
        'messaging.destination.name': s.topic_name,
        'messaging.operation.name': CASE operation
            WHEN 'send' THEN 'publish' WHEN 'receive' THEN 'take' ELSE operation END,
        'messaging.operation.type': operation,
        'rpc.system.name': CASE WHEN s.service IS NOT NULL THEN 'ros2' END,
        'rpc.method': s.service,
        'code.function.name': s.symbol,
        'thread.id': t.tid,
        'thread.name': t.name,
        'msgflow.link': s.link_kind,
        'msgflow.candidate_count': a.candidate_count,
        'msgflow.latency_ns': CASE WHEN s.kind = 'take' THEN s.start_ns - u.end_ns END
    } AS attributes
FROM span AS s
JOIN described AS o ON s.root_key = o.key
LEFT JOIN root AS p ON s.cause_key = p.key
LEFT JOIN described AS u ON s.link_kind = 'transport' AND s.cause_key = u.key
LEFT JOIN further AS w ON s.key = w.key
LEFT JOIN derive.ambiguous_effect AS a ON s.kind = a.kind AND s.id = a.id AND a.run_id = $run_id
LEFT JOIN fate AS f ON s.kind = 'publication' AND s.id = f.publication_id
JOIN main.process AS e ON s.process_id = e.process_id
JOIN main.host AS h ON e.host_id = h.host_id
LEFT JOIN main.thread AS t ON s.thread_id = t.thread_id
ORDER BY o.start_ns, s.root_key, s.start_ns, s.key
