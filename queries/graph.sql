-- title: Which node sends what to which, how often and how fast
-- description: The computation graph: nodes, and the topics, services and actions between them,
--     with rates and latencies. The services of an action are no rows of their own. As dot,
--     mermaid and json it is for programs that draw it: topics show their rate, nodes of one
--     executor stand together, and dashed (periodic_async, queue) and dotted (partial_sync,
--     approximate_sync) arrows lead to what an indirect link causes.
-- grain: one row per node, topic, service or action, and what the node does with it
-- column: run_id
-- column: kind VARCHAR             What the node does: 'publish', 'receive', 'call', 'serve', or
--     with goals of an action 'send', 'execute'
-- column: node VARCHAR [node]  Node
-- column: name VARCHAR [topic]  Topic, service or action
-- column: indirect VARCHAR         How messages wait in the node for what is published:
--     'periodic_async', 'partial_sync', 'approximate_sync', 'queue', or several; empty: no indirect
--     link leads to it
-- column: count BIGINT             Messages, requests or goals in the time window
-- column: rate_hz DOUBLE [Hz]      Rate from the first to the last
-- column: median_ns BIGINT [ns]    Median latency: for 'receive' from publication to take, for
--     'call' from sending the request to taking the response, for 'send' from sending the goal to
--     taking its result
-- column: p95_ns
-- column: executor VARCHAR         Executor of the node: process, host, kind and threads; empty:
--     not known, or several
-- column: executor_id BIGINT       Its identity
-- column: is_internal
-- brief: kind, node, name, rate_hz, median_ns, p95_ns, count, indirect, executor
-- note: clocks
WITH indirect AS (
    SELECT
        b.publisher_id,
        string_agg(DISTINCT l.kind, ', ' ORDER BY l.kind) AS kinds
    FROM main.link_causal AS l
    JOIN main.publication AS b ON l.publication_id = b.publication_id
    WHERE list_contains($runs, l.run_id)
        AND l.kind IN ('periodic_async', 'partial_sync', 'approximate_sync', 'queue')
    GROUP BY b.publisher_id
),
answer AS (
    SELECT
        request_id,
        min(taken_ns) AS taken_ns
    FROM main.response
    WHERE list_contains($runs, run_id) AND request_id IS NOT NULL
    GROUP BY request_id
),
event AS (
    SELECT
        b.run_id,
        'publish' AS kind,
        p.node_id, p.process_id,
        p.topic_name AS name,
        p.is_internal,
        b.start_ns AS at_ns,
        NULL::BIGINT AS latency_ns,
        i.kinds
    FROM main.publication AS b
    JOIN main.publisher AS p ON b.publisher_id = p.publisher_id
    LEFT JOIN indirect AS i ON b.publisher_id = i.publisher_id
    UNION ALL
    SELECT
        t.run_id, 'receive', s.node_id, s.process_id, s.topic_name, s.is_internal, t.taken_ns,
        l.latency_ns, NULL
    FROM main.take AS t
    JOIN main.subscription AS s ON t.subscription_id = s.subscription_id
    LEFT JOIN main.link_transport AS l ON t.take_id = l.take_id
    WHERE t.method <> 'callback_only'
    UNION ALL
    SELECT
        q.run_id, 'call', c.node_id, c.process_id, c.service_name, c.is_internal,
        coalesce(q.sent_ns, q.taken_ns),
        r.taken_ns - q.sent_ns,
        NULL
    FROM main.request AS q
    JOIN main.client AS c ON q.client_id = c.client_id
    LEFT JOIN answer AS r ON q.request_id = r.request_id
    WHERE NOT coalesce(contains(c.service_name, '/_action/'), false)
    UNION ALL
    SELECT
        q.run_id, 'serve', s.node_id, s.process_id, s.service_name, s.is_internal,
        coalesce(q.sent_ns, q.taken_ns),
        NULL, NULL
    FROM main.request AS q
    JOIN main.service AS s ON q.service_id = s.service_id
    WHERE NOT coalesce(contains(s.service_name, '/_action/'), false)
    UNION ALL
    SELECT
        g.run_id, 'send', c.node_id, c.process_id, g.action_name, c.is_internal,
        coalesce(g.sent_ns, g.taken_ns),
        g.latency_ns, NULL
    FROM main.goal AS g
    JOIN main.client AS c ON g.action_client_id = c.client_id
    UNION ALL
    SELECT
        g.run_id, 'execute', s.node_id, s.process_id, g.action_name, s.is_internal,
        coalesce(g.sent_ns, g.taken_ns),
        NULL, NULL
    FROM main.goal AS g
    JOIN main.service AS s ON g.action_server_id = s.service_id
),
edge AS (
    SELECT
        e.run_id, e.kind,
        main.node_label(n.full_name, p.name, p.pid) AS node,
        coalesce(e.name, '?') AS name,
        bool_and(coalesce(e.is_internal, false)) AS is_internal,
        string_agg(DISTINCT e.kinds, ', ' ORDER BY e.kinds) AS indirect,
        count(*) AS count,
        (count(*) - 1) * 1e9 / nullif(max(e.at_ns) - min(e.at_ns), 0) AS rate_hz,
        quantile_disc(e.latency_ns, [0.5, 0.95]) AS quantiles
    FROM event AS e
    JOIN main.process AS p ON e.process_id = p.process_id
    LEFT JOIN main.node AS n ON e.node_id = n.node_id
    WHERE list_contains($runs, e.run_id) AND e.at_ns >= $start_ns AND e.at_ns < $end_ns
    GROUP BY ALL
),
-- Nodes whose callbacks one executor ran.
home AS (
    SELECT
        i.run_id, l.node,
        min(x.executor_id) AS executor_id
    FROM (
        SELECT DISTINCT run_id, callback_id, thread_id
        FROM main.callback_instance
        WHERE list_contains($runs, run_id)
    ) AS i
    JOIN main.executor_thread AS x ON i.thread_id = x.thread_id
    JOIN main.callback_label AS l ON i.callback_id = l.callback_id
    GROUP BY i.run_id, l.node
    HAVING min(x.executor_id) = max(x.executor_id)
),
executor AS (
    SELECT
        e.executor_id,
        printf(
            '%s %d on %s: %s, %d %s', coalesce(p.name, '?'), p.pid, h.hostname,
            replace(e.kind, '_', '-'), count(*),
            CASE count(*) WHEN 1 THEN 'thread' ELSE 'threads' END
        ) AS label
    FROM main.executor AS e
    JOIN main.executor_thread AS x ON e.executor_id = x.executor_id
    JOIN main.process AS p ON e.process_id = p.process_id
    JOIN main.host AS h ON p.host_id = h.host_id
    GROUP BY e.executor_id, p.name, p.pid, h.hostname, e.kind
)
SELECT
    e.run_id, e.kind, e.node, e.name, e.indirect, e.count, e.rate_hz,
    e.quantiles[1] AS median_ns,
    e.quantiles[2] AS p95_ns,
    x.label AS executor,
    h.executor_id, e.is_internal
FROM edge AS e
LEFT JOIN home AS h ON e.run_id = h.run_id AND e.node = h.node
LEFT JOIN executor AS x ON h.executor_id = x.executor_id
ORDER BY e.run_id, e.node, e.kind, e.name
