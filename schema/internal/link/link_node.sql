-- description: The nodes of a run that a link may be declared for, with their subscriptions and
--     publishers of known topics, as a list of each.
-- grain: one row per node with a name
WITH ends AS (
    SELECT
        node_id,
        'subscription' AS kind,
        {'id': subscription_id, 'topic': topic_name, 'is_internal': is_internal} AS endpoint
    FROM main.subscription
    WHERE run_id = $run_id AND topic_name IS NOT NULL
    UNION ALL
    SELECT
        node_id, 'publisher',
        {'id': publisher_id, 'topic': topic_name, 'is_internal': is_internal}
    FROM main.publisher
    WHERE run_id = $run_id AND topic_name IS NOT NULL
)
SELECT
    list(e.endpoint ORDER BY e.endpoint.id) FILTER (e.kind = 'subscription') AS subscriptions,
    list(e.endpoint ORDER BY e.endpoint.id) FILTER (e.kind = 'publisher') AS publishers,
    main.node_name(n.full_name) AS name,
    n.process_id,
    coalesce(p.name, '?') AS process,
    p.pid,
    h.hostname AS host
FROM main.node AS n
JOIN main.process AS p ON n.process_id = p.process_id
JOIN main.host AS h ON p.host_id = h.host_id
LEFT JOIN ends AS e ON n.node_id = e.node_id
WHERE n.run_id = $run_id AND n.full_name IS NOT NULL
GROUP BY n.node_id, n.full_name, n.process_id, p.name, p.pid, h.hostname
ORDER BY n.node_id
