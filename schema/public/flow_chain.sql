-- description: The chains of main.flow_path, each as its last step and a pointer to the chain
--     without it: the cost of lists of what lies on them would grow with the square of their
--     length. No subscription comes twice in a chain. What asks several of main.flow_path,
--     main.end_to_end and main.end_to_end_trail keeps these rows in a table, and names it to them.
-- grain: one row per run and chain
-- param: runs, from_topic, to_topic, max_depth, max_paths
-- column: run_id
-- column: path_id BIGINT  Number of the chain in this result
-- column: parent_path_id, depth, publisher_id
-- column: subscription_id BIGINT  Last subscription
-- column: route BIGINT[]  How the flow came to the last publisher, as in routes of main.flow_path
-- column: first_publisher_id BIGINT  First publisher; below 0: not traced
-- column: first_route BIGINT[]  How the flow came to that one
-- column: is_cached, is_path
-- column: is_cut BOOLEAN  The chain goes on, or has siblings, beyond the limits
CREATE OR REPLACE MACRO main.flow_chain(
    runs, from_topic := NULL, to_topic := NULL, max_depth := 32, max_paths := 1000
) AS TABLE
WITH RECURSIVE start_place AS MATERIALIZED (FROM derive.place(runs, from_topic)),
end_place AS MATERIALIZED (FROM derive.place(runs, to_topic)),
hop AS MATERIALIZED (
    SELECT
        h.run_id, h.from_subscription_id, h.route, h.publisher_id, h.subscription_id, h.is_cached,
        coalesce(p.topic_name, s.topic_name) AS topic,
        CASE
            WHEN h.from_subscription_id IS NOT NULL THEN false
            WHEN from_topic IS NULL THEN h.is_source
            ELSE (topic IN (SELECT topic_name FROM start_place)) IS true
                OR (p.node_id IN (SELECT node_id FROM start_place)) IS true
        END AS is_start,
        (topic IN (SELECT topic_name FROM end_place)) IS true
        OR (s.node_id IN (SELECT node_id FROM end_place)) IS true AS is_last
    FROM store.flow_hop AS h
    LEFT JOIN store.publisher AS p ON h.publisher_id = p.publisher_id
    JOIN store.subscription AS s ON h.subscription_id = s.subscription_id
    WHERE list_contains(runs, h.run_id)
),
-- Only what leads to the end asked for is followed: nothing else needs to be enumerated.
toward_end (subscription_id) AS (
    SELECT subscription_id FROM hop WHERE to_topic IS NULL OR is_last
    UNION
    SELECT h.from_subscription_id
    FROM toward_end AS l
    JOIN hop AS h ON l.subscription_id = h.subscription_id
    WHERE h.from_subscription_id IS NOT NULL
),
place AS (
    SELECT
        subscription_id,
        (row_number() OVER (ORDER BY subscription_id) - 1)::INTEGER AS place,
        bitstring('0', (count(*) OVER ())::INTEGER) AS nowhere
    FROM toward_end
),
useful AS MATERIALIZED (
    SELECT
        h.*, l.place, l.nowhere,
        row_number() OVER (
            ORDER BY
                h.run_id, h.from_subscription_id, h.publisher_id, h.subscription_id, h.route
        ) AS hop_id
    FROM hop AS h
    JOIN place AS l ON h.subscription_id = l.subscription_id
),
-- Chains of one length are in the order of their publishers, then of their subscriptions, then of
-- their routes. Ranks among those lists stand for the lists. Windows without PARTITION BY take a
-- third of the time, at every step.
chain AS (
    SELECT
        run_id,
        1::BIGINT AS depth,
        row_number() OVER (ORDER BY run_id, publisher_id, subscription_id, route)
        - rank() OVER (ORDER BY run_id) + 1 AS number,
        NULL::BIGINT AS parent_number,
        hop_id AS first_hop_id,
        hop_id, subscription_id, is_last,
        set_bit(nowhere, place, 1) AS visited,
        NULL::BIGINT AS parent_publishers_rank,
        dense_rank() OVER (ORDER BY run_id, publisher_id) AS publishers_rank,
        dense_rank() OVER (ORDER BY run_id, subscription_id) AS subscriptions_rank,
        dense_rank() OVER (ORDER BY run_id, route) AS routes_rank,
        count(*) OVER (PARTITION BY run_id) > max_paths AS is_crowded
    FROM useful
    WHERE is_start
    QUALIFY number <= max_paths
    UNION ALL
    SELECT
        run_id, depth,
        row_number() OVER (ORDER BY run_id, publishers_rank, subscriptions_rank, routes_rank)
        - rank() OVER (ORDER BY run_id) + 1 AS number,
        parent_number, first_hop_id, hop_id, subscription_id, is_last, visited,
        parent_publishers_rank, publishers_rank, subscriptions_rank, routes_rank, is_crowded
    FROM (
        SELECT
            c.run_id,
            c.depth + 1 AS depth,
            c.number AS parent_number,
            c.first_hop_id, u.hop_id, u.subscription_id, u.is_last,
            set_bit(c.visited, u.place, 1) AS visited,
            c.publishers_rank AS parent_publishers_rank,
            dense_rank() OVER (
                ORDER BY c.run_id, c.publishers_rank, u.publisher_id
            ) AS publishers_rank,
            dense_rank() OVER (
                ORDER BY c.run_id, c.subscriptions_rank, u.subscription_id
            ) AS subscriptions_rank,
            dense_rank() OVER (ORDER BY c.run_id, c.routes_rank, u.route) AS routes_rank,
            c.is_crowded OR count(*) OVER (PARTITION BY c.run_id) > max_paths AS is_crowded
        FROM chain AS c
        JOIN useful AS u ON c.subscription_id = u.from_subscription_id
        WHERE c.depth < max_depth AND NOT c.is_last AND get_bit(c.visited, u.place) = 0
    )
    QUALIFY number <= max_paths
),
-- Chains of different lengths: a chain comes behind all chains whose lists of publishers are
-- beginnings of its own, and before the next list. Lists of publishers are the nodes of a tree, and
-- this is the order in which a walk around the tree enters them. How many nodes the walk has still
-- to enter is added up over ever longer parts of the walk.
list AS MATERIALIZED (
    SELECT
        row_number() OVER (ORDER BY run_id, depth, publishers_rank) AS list_id,
        run_id, depth, publishers_rank, parent_publishers_rank
    FROM (SELECT DISTINCT run_id, depth, publishers_rank, parent_publishers_rank FROM chain)
),
around AS (
    SELECT
        l.list_id,
        p.list_id AS parent_id,
        lead(l.list_id) OVER (
            PARTITION BY l.run_id, l.depth, l.parent_publishers_rank ORDER BY l.list_id
        ) AS next_id
    FROM list AS l
    LEFT JOIN list AS p
        ON l.run_id = p.run_id
        AND l.depth - 1 = p.depth
        AND l.parent_publishers_rank = p.publishers_rank
),
walk (point, next_point, entered) USING KEY (point) AS (
    SELECT
        2 * a.list_id,
        coalesce(2 * c.child_id, 2 * a.list_id + 1),
        1::BIGINT
    FROM around AS a
    LEFT JOIN (
        SELECT
            parent_id,
            min(list_id) AS child_id
        FROM around
        GROUP BY parent_id
    ) AS c ON a.list_id = c.parent_id
    UNION ALL
    SELECT
        2 * list_id + 1,
        coalesce(2 * next_id, 2 * parent_id + 1),
        0
    FROM around
    UNION
    SELECT
        w.point, n.next_point,
        w.entered + n.entered
    FROM walk AS w
    JOIN recurring.walk AS n ON w.next_point = n.point
),
numbered AS MATERIALIZED (
    SELECT
        c.run_id, c.depth, c.number, c.parent_number, c.first_hop_id, c.hop_id, c.is_last,
        c.is_crowded,
        row_number() OVER (
            ORDER BY c.run_id, w.entered DESC, c.subscriptions_rank, c.routes_rank
        ) AS path_id
    FROM chain AS c
    JOIN list AS l
        ON c.run_id = l.run_id AND c.depth = l.depth AND c.publishers_rank = l.publishers_rank
    JOIN walk AS w ON 2 * l.list_id = w.point
),
ended AS (
    FROM chain AS c
    ANTI JOIN chain AS n
        ON c.run_id = n.run_id AND c.depth + 1 = n.depth AND c.number = n.parent_number
),
continuable AS (
    SELECT DISTINCT c.run_id, c.depth, c.number
    FROM ended AS c
    JOIN useful AS u ON c.subscription_id = u.from_subscription_id
    WHERE get_bit(c.visited, u.place) = 0 AND NOT c.is_last
),
limited AS (
    SELECT
        n.run_id, n.path_id,
        p.path_id AS parent_path_id,
        n.depth, n.first_hop_id, n.hop_id,
        CASE WHEN to_topic IS NULL THEN e.number IS NOT NULL ELSE n.is_last END AS is_candidate,
        n.is_crowded OR c.number IS NOT NULL AS is_cut
    FROM numbered AS n
    LEFT JOIN numbered AS p
        ON n.run_id = p.run_id AND n.depth - 1 = p.depth AND n.parent_number = p.number
    LEFT JOIN ended AS e ON n.run_id = e.run_id AND n.depth = e.depth AND n.number = e.number
    LEFT JOIN continuable AS c ON n.run_id = c.run_id AND n.depth = c.depth AND n.number = c.number
),
ranked AS (
    SELECT
        *,
        row_number() OVER (PARTITION BY run_id, is_candidate ORDER BY depth, path_id) AS path_number
    FROM limited
)
SELECT
    r.run_id, r.path_id, r.parent_path_id, r.depth, u.publisher_id, u.subscription_id, u.route,
    f.publisher_id AS first_publisher_id,
    f.route AS first_route,
    u.is_cached,
    r.is_candidate AND r.path_number <= max_paths AS is_path,
    CASE
        WHEN bool_or(r.is_candidate AND r.path_number > max_paths) OVER run THEN true
        WHEN to_topic IS NULL THEN r.is_cut
        ELSE bool_or(r.is_cut) OVER run
    END AS is_cut
FROM ranked AS r
JOIN useful AS u ON r.hop_id = u.hop_id
JOIN useful AS f ON r.first_hop_id = f.hop_id
WINDOW run AS (PARTITION BY r.run_id)
-- Nothing is cut here: chains of one length are at most max_paths. But without it DuckDB expects
-- far too many chains, and wherever something is joined to chains it keeps tables of all takes, to
-- look up a few.
LIMIT least(max_depth::DOUBLE * max_paths * len(runs), 1e15)::BIGINT
