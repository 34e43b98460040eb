-- description: Chains of publishers and subscriptions that flows can take, with all their
--     beginnings. No subscription comes twice in a chain. Where a service led to a publication, the
--     chain has the node that called and the services in between. A publisher that is not traced is
--     '(not traced)'. A chain is a path if it ends at the topic asked for, or if nothing continues
--     it. Chains are cut at max_depth and max_paths; is_cut marks each chain that has more to it,
--     or all of the run if it is not known which.
-- grain: one row per run and chain
-- param: runs, from_topic, to_topic, max_depth, max_paths
-- param: only_paths BOOLEAN = false  Leave out chains that are not paths
-- param: chains
-- column: run_id
-- column: path_id BIGINT  Number of the chain in this result
-- column: alike_id
-- column: parent_path_id, depth
-- column: publishers BIGINT[]  Publishers in order; below 0: not traced
-- column: subscriptions BIGINT[]  Subscriptions in order
-- column: topics
-- column: routes BIGINT[][]  For each topic the calling node (negative: its process; 0: not known),
--     then the services in order (0: not known); empty: no service led to it
-- column: path VARCHAR  Nodes and topics in order, services in brackets, for people
-- column: publisher_id
-- column: subscription_id BIGINT  Last subscription
-- column: is_cached, is_path
-- column: is_cut BOOLEAN  The chain goes on, or has siblings, beyond the limits
CREATE OR REPLACE MACRO main.flow_path(
    runs, from_topic := NULL, to_topic := NULL, max_depth := 32, max_paths := 1000,
    only_paths := false, chains := 'chain_here'
) AS TABLE
WITH RECURSIVE chain_here AS MATERIALIZED (
    FROM main.flow_chain(runs, from_topic, to_topic, max_depth := max_depth, max_paths := max_paths)
),
chain AS NOT MATERIALIZED (FROM query_table(chains)),
called AS (
    SELECT
        r.route, r.position,
        printf(
            '(%s) → %s',
            coalesce(s.service_name, '?'),
            CASE WHEN p.process_id IS NULL THEN '?'
                ELSE main.node_label(n.full_name, p.name, p.pid) END
        ) AS label,
        s.node_id
    FROM (
        SELECT
            route,
            unnest(route[2:]) AS service_id,
            unnest(range(2, len(route) + 1)) AS position
        FROM (SELECT DISTINCT route FROM chain)
    ) AS r
    LEFT JOIN store.service AS s ON r.service_id = s.service_id
    LEFT JOIN store.node AS n ON s.node_id = n.node_id
    LEFT JOIN store.process AS p ON s.process_id = p.process_id
),
route AS (
    SELECT
        c.route,
        any_value(
            CASE WHEN p.process_id IS NULL THEN '?'
                ELSE main.node_label(n.full_name, p.name, p.pid) END
        ) AS caller,
        string_agg(c.label, ' → ' ORDER BY c.position) AS services,
        arg_max_null(c.node_id, c.position) AS last_node_id
    FROM called AS c
    LEFT JOIN store.node AS n ON c.route[1] = n.node_id
    LEFT JOIN store.process AS p ON coalesce(n.process_id, -c.route[1]) = p.process_id
    GROUP BY c.route
),
lineage (path_id, step_id, depth, parent_path_id) AS (
    SELECT path_id, path_id, depth, parent_path_id FROM chain WHERE is_path OR NOT only_paths
    UNION ALL
    SELECT l.path_id, c.path_id, c.depth, c.parent_path_id
    FROM lineage AS l
    JOIN chain AS c ON l.parent_path_id = c.path_id
),
step AS (
    SELECT
        c.path_id, c.publisher_id, c.subscription_id, c.route,
        CASE WHEN c.publisher_id < 0 THEN s.topic_name ELSE p.topic_name END AS topic_name,
        concat_ws(
            ' → ',
            CASE WHEN c.depth = 1
                THEN CASE WHEN c.publisher_id < 0 THEN '(not traced)'
                    ELSE coalesce(r.caller, main.node_label(pn.full_name, pp.name, pp.pid)) END END,
            r.services,
            -- Who called publishes with the response that came back.
            CASE WHEN r.services IS NOT NULL AND r.last_node_id IS DISTINCT FROM p.node_id
                THEN main.node_label(pn.full_name, pp.name, pp.pid) END,
            coalesce(CASE WHEN c.publisher_id < 0 THEN s.topic_name ELSE p.topic_name END, '?'),
            main.node_label(sn.full_name, sp.name, sp.pid)
        ) AS label
    FROM chain AS c
    LEFT JOIN route AS r ON c.route = r.route
    LEFT JOIN store.publisher AS p ON c.publisher_id = p.publisher_id
    LEFT JOIN store.process AS pp ON p.process_id = pp.process_id
    LEFT JOIN store.node AS pn ON p.node_id = pn.node_id
    JOIN store.subscription AS s ON c.subscription_id = s.subscription_id
    JOIN store.process AS sp ON s.process_id = sp.process_id
    LEFT JOIN store.node AS sn ON s.node_id = sn.node_id
),
whole AS (
    SELECT
        l.path_id,
        list(s.publisher_id ORDER BY l.depth) AS publishers,
        list(s.subscription_id ORDER BY l.depth) AS subscriptions,
        list(s.topic_name ORDER BY l.depth) AS topics,
        list(s.route ORDER BY l.depth) AS routes,
        string_agg(s.label, ' → ' ORDER BY l.depth) AS path
    FROM lineage AS l
    JOIN step AS s ON l.step_id = s.path_id
    GROUP BY l.path_id
)
SELECT
    c.run_id, c.path_id,
    min(c.path_id) OVER (PARTITION BY c.run_id, c.is_path, w.path) AS alike_id,
    c.parent_path_id, c.depth, w.publishers, w.subscriptions, w.topics,
    w.routes, w.path, c.publisher_id, c.subscription_id, c.is_cached, c.is_path, c.is_cut
FROM chain AS c
JOIN whole AS w ON c.path_id = w.path_id
