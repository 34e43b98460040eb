-- name: main.flow_path
-- kind: macro
-- description: Chains of publishers and subscriptions that flows can take, with all their
--     beginnings (prefixes). No subscription comes twice in a chain. Where a call of a service led
--     to a publication, chains tell by whose call, through which services. A chain is a path where
--     it ends at the topic asked for, or where it is not continued. Chains longer than max_depth
--     and beyond max_paths are cut; is_cut says so of each chain that has more to it, or of all
--     chains of the run where it cannot be told which.
-- grain: one row per run and chain
-- param: runs BIGINT[]  Runs to look at
-- param: from_topic VARCHAR  Topic where flows start; every source when NULL
-- param: to_topic VARCHAR  Topic where flows end; wherever they end when NULL
-- param: max_depth INTEGER = 32  Longest chain, in topics
-- param: max_paths INTEGER = 1000  Most paths, shortest first, and most chains per length
-- column: run_id BIGINT  Run
-- column: path_id BIGINT  Number of the chain in this result
-- column: parent_path_id BIGINT  The chain without its last step; NULL: it has one step
-- column: depth BIGINT  Steps (topics) of the chain
-- column: publishers BIGINT[]  Publishers in order
-- column: subscriptions BIGINT[]  Subscriptions in order
-- column: topics VARCHAR[]  Topics in order
-- column: routes BIGINT[][]  For each topic, empty where no service led to it: the node that called
--     (negative: its process; 0: not known), then the services in order (0: not known)
-- column: path VARCHAR  Nodes and topics in order, services in brackets, for people
-- column: publisher_id BIGINT  Last publisher
-- column: subscription_id BIGINT  Last subscription
-- column: is_cached BOOLEAN  The last step may wait in its node for other messages
-- column: is_path BOOLEAN  The chain is a path, not only the beginning of some
-- column: is_cut BOOLEAN  The chain goes on, or has siblings, beyond the limits
-- needs: derive.flow_hop, derive.node_label, store.publisher, store.subscription, store.node,
--     store.process, store.service
CREATE OR REPLACE MACRO main.flow_path(
    runs, from_topic, to_topic, max_depth := 32, max_paths := 1000
) AS TABLE
WITH RECURSIVE taken_hop AS MATERIALIZED (
    SELECT
        run_id, from_subscription_id, route, publisher_id, subscription_id, is_source, is_cached
    FROM derive.flow_hop
    WHERE list_contains(runs, run_id)
),
called AS (
    SELECT
        r.route,
        r.position,
        printf(
            '(%s) → %s',
            coalesce(s.service_name, '?'),
            CASE WHEN p.process_id IS NULL THEN '?'
                ELSE derive.node_label(n.full_name, p.name, p.pid) END
        ) AS label
    FROM (
        SELECT
            route, unnest(route[2:]) AS service_id, unnest(range(2, len(route) + 1)) AS position
        FROM (SELECT DISTINCT route FROM taken_hop)
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
                ELSE derive.node_label(n.full_name, p.name, p.pid) END
        ) AS caller,
        string_agg(c.label, ' → ' ORDER BY c.position) AS services
    FROM called AS c
    LEFT JOIN store.node AS n ON c.route[1] = n.node_id
    LEFT JOIN store.process AS p ON coalesce(n.process_id, -c.route[1]) = p.process_id
    GROUP BY c.route
),
hop AS MATERIALIZED (
    SELECT
        h.run_id, h.from_subscription_id, h.route, h.publisher_id, h.subscription_id, h.is_cached,
        p.topic_name,
        coalesce(r.caller, derive.node_label(pn.full_name, pp.name, pp.pid)) AS from_node,
        r.services,
        derive.node_label(sn.full_name, sp.name, sp.pid) AS to_node,
        CASE
            WHEN h.from_subscription_id IS NOT NULL THEN false
            WHEN from_topic IS NULL THEN h.is_source
            ELSE coalesce(p.topic_name = from_topic, false)
        END AS is_start
    FROM taken_hop AS h
    LEFT JOIN route AS r ON h.route = r.route
    JOIN store.publisher AS p ON h.publisher_id = p.publisher_id
    JOIN store.process AS pp ON p.process_id = pp.process_id
    LEFT JOIN store.node AS pn ON p.node_id = pn.node_id
    JOIN store.subscription AS s ON h.subscription_id = s.subscription_id
    JOIN store.process AS sp ON s.process_id = sp.process_id
    LEFT JOIN store.node AS sn ON s.node_id = sn.node_id
),
-- Only what leads to the topic asked for is followed, so that nothing else is enumerated.
toward_end (run_id, subscription_id) AS (
    SELECT run_id, subscription_id
    FROM hop
    WHERE to_topic IS NULL OR topic_name = to_topic
    UNION
    SELECT h.run_id, h.from_subscription_id
    FROM toward_end AS l
    JOIN hop AS h ON l.subscription_id = h.subscription_id
    WHERE h.from_subscription_id IS NOT NULL
),
useful AS MATERIALIZED (
    SELECT
        h.run_id, h.from_subscription_id, h.route, h.publisher_id, h.subscription_id,
        h.is_cached, h.topic_name, h.from_node, h.services, h.to_node, h.is_start
    FROM hop AS h
    JOIN toward_end AS l ON h.subscription_id = l.subscription_id
),
chain AS (
    SELECT
        run_id,
        [publisher_id] AS publishers,
        [subscription_id] AS subscriptions,
        [topic_name] AS topics,
        [route] AS routes,
        concat_ws(' → ', from_node, services, coalesce(topic_name, '?'), to_node) AS path,
        is_cached,
        count(*) OVER (PARTITION BY run_id) > max_paths AS is_crowded
    FROM useful
    WHERE is_start
    QUALIFY row_number() OVER (
        PARTITION BY run_id ORDER BY publisher_id, subscription_id, route
    ) <= max_paths
    UNION ALL
    SELECT run_id, publishers, subscriptions, topics, routes, path, is_cached, is_crowded
    FROM (
        SELECT
            c.run_id,
            list_append(c.publishers, u.publisher_id) AS publishers,
            list_append(c.subscriptions, u.subscription_id) AS subscriptions,
            list_append(c.topics, u.topic_name) AS topics,
            list_append(c.routes, u.route) AS routes,
            concat_ws(' → ', c.path, u.services, coalesce(u.topic_name, '?'), u.to_node) AS path,
            u.is_cached,
            c.is_crowded OR count(*) OVER (PARTITION BY c.run_id) > max_paths AS is_crowded
        FROM chain AS c
        JOIN useful AS u
            ON c.subscriptions[-1] = u.from_subscription_id
        WHERE len(c.subscriptions) < max_depth
            AND NOT list_contains(c.subscriptions, u.subscription_id)
            AND (to_topic IS NULL OR c.topics[-1] IS DISTINCT FROM to_topic)
    )
    QUALIFY row_number() OVER (
        PARTITION BY run_id ORDER BY publishers, subscriptions, routes
    ) <= max_paths
),
numbered AS MATERIALIZED (
    SELECT
        run_id, publishers, subscriptions, topics, routes, path, is_cached, is_crowded,
        row_number() OVER (ORDER BY run_id, publishers, subscriptions, routes) AS path_id
    FROM chain
),
continuable AS (
    SELECT DISTINCT n.path_id
    FROM numbered AS n
    JOIN useful AS u ON n.subscriptions[-1] = u.from_subscription_id
    WHERE NOT list_contains(n.subscriptions, u.subscription_id)
        AND (to_topic IS NULL OR n.topics[-1] IS DISTINCT FROM to_topic)
),
parented AS MATERIALIZED (
    SELECT n.path_id, p.path_id AS parent_path_id
    FROM numbered AS n
    JOIN numbered AS p
        ON p.publishers = n.publishers[:-2]
        AND p.subscriptions = n.subscriptions[:-2]
        AND p.routes = n.routes[:-2]
),
limited AS (
    SELECT
        n.run_id, n.path_id, n.publishers, n.subscriptions, n.topics, n.routes, n.path,
        n.is_cached, p.parent_path_id,
        n.path_id NOT IN (SELECT parent_path_id FROM parented) AS is_end,
        n.is_crowded
        OR (
            n.path_id IN (SELECT path_id FROM continuable)
            AND n.path_id NOT IN (SELECT parent_path_id FROM parented)
        ) AS is_cut
    FROM numbered AS n
    LEFT JOIN parented AS p ON n.path_id = p.path_id
),
ranked AS (
    SELECT
        run_id, path_id, parent_path_id, publishers, subscriptions, topics, routes, path,
        is_cached, is_cut,
        CASE WHEN to_topic IS NULL THEN is_end ELSE topics[-1] = to_topic END AS is_candidate,
        row_number() OVER (
            PARTITION BY
                run_id, CASE WHEN to_topic IS NULL THEN is_end ELSE topics[-1] = to_topic END
            ORDER BY len(subscriptions), path_id
        ) AS path_number
    FROM limited
)
SELECT
    run_id,
    path_id,
    parent_path_id,
    len(subscriptions) AS depth,
    publishers,
    subscriptions,
    topics,
    routes,
    path,
    publishers[-1] AS publisher_id,
    subscriptions[-1] AS subscription_id,
    is_cached,
    is_candidate AND path_number <= max_paths AS is_path,
    CASE
        WHEN bool_or(is_candidate AND path_number > max_paths) OVER run THEN true
        WHEN to_topic IS NULL THEN is_cut
        ELSE bool_or(is_cut) OVER run
    END AS is_cut
FROM ranked
WINDOW run AS (PARTITION BY run_id)
