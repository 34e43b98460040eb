-- description: The messages on the way of each flow (main.end_to_end_flow), from its root to its
--     end. Of several ways it is that whose list of publications, then of takes, comes first.
-- grain: one row per flow and message on its way
-- param: flows, runs, from_topic, to_topic, max_depth, max_paths, chains
-- column: flow_id BIGINT  Number of the flow
-- column: hop BIGINT  Number of the message on the path
-- column: take_id BIGINT  Identity of the take
-- column: publication_id BIGINT  The message; below 0: its publisher is not traced
-- column: previous_take_id BIGINT  Take of the message before it; NULL: none
-- column: next_take_id BIGINT  Take of the message after it; NULL: none
CREATE OR REPLACE MACRO main.end_to_end_trail(
    flows, runs, from_topic := NULL, to_topic := NULL, max_depth := 32, max_paths := 1000,
    chains := 'chain_here'
) AS TABLE
WITH RECURSIVE flow AS NOT MATERIALIZED (FROM query_table(flows)),
chain_here AS MATERIALIZED (
    FROM main.flow_chain(runs, from_topic, to_topic, max_depth := max_depth, max_paths := max_paths)
),
chain AS NOT MATERIALIZED (FROM query_table(chains)),
-- Before each message of a path but the first: the message that led to it, and how.
link AS MATERIALIZED (
    SELECT
        c.path_id,
        p.path_id AS parent_path_id,
        dense_rank() OVER (ORDER BY c.route, p.publisher_id, p.subscription_id) AS way_id,
        c.route, p.publisher_id, p.subscription_id
    FROM chain AS c
    JOIN chain AS p ON c.parent_path_id = p.path_id
),
way AS MATERIALIZED (SELECT DISTINCT way_id, route, publisher_id, subscription_id FROM link),
-- What led to each publication, by way of a callback of the node or of a service that it called.
continuation AS NOT MATERIALIZED (
    SELECT
        publication_id, take_id, subscription_id,
        []::BIGINT[] AS route
    FROM derive.certain_cause
    WHERE list_contains(runs, run_id)
    UNION ALL
    SELECT publication_id, take_id, subscription_id, route
    FROM store.flow_call
    WHERE list_contains(runs, run_id)
),
-- Steps back: from a publication to the message that led to it. What recursion looks up stays in
-- memory: one number stands for all that a step has to fit.
step AS MATERIALIZED (
    SELECT
        c.publication_id AS next_publication_id,
        w.way_id, t.take_id, t.publication_id
    FROM continuation AS c
    JOIN derive.flow_transport AS t ON c.take_id = t.take_id
    JOIN way AS w
        ON c.route = w.route
        AND c.subscription_id = w.subscription_id
        AND t.publisher_id = w.publisher_id
    WHERE list_contains(runs, t.run_id)
),
-- From the end of each flow back to its root, one way of each: that whose list of publications,
-- then of takes, comes first. Ranks among those lists stand for the lists.
trail (
    flow_id, path_id, hop, take_id, publication_id, next_take_id, publications_rank, takes_rank
) AS (
    SELECT
        f.flow_id, c.path_id, c.depth, f.take_id, t.publication_id,
        NULL::BIGINT,
        1, 1
    FROM flow AS f
    JOIN chain AS c ON f.path_id = c.path_id
    JOIN derive.flow_transport AS t ON f.take_id = t.take_id
    WHERE list_contains(runs, t.run_id)
    UNION ALL
    SELECT
        flow_id, path_id, hop, take_id, publication_id, way.next_take_id,
        dense_rank() OVER (ORDER BY flow_id, publication_id, way.publications_rank),
        dense_rank() OVER (ORDER BY flow_id, take_id, way.takes_rank)
    FROM (
        SELECT
            r.flow_id,
            l.parent_path_id AS path_id,
            r.hop - 1 AS hop,
            s.take_id, s.publication_id,
            min(struct_pack(
                publications_rank := r.publications_rank,
                takes_rank := r.takes_rank,
                next_take_id := r.take_id
            )) AS way
        FROM trail AS r
        JOIN link AS l ON r.path_id = l.path_id
        JOIN step AS s ON r.publication_id = s.next_publication_id AND l.way_id = s.way_id
        GROUP BY r.flow_id, l.parent_path_id, r.hop, s.take_id, s.publication_id
    )
),
whole AS (
    SELECT r.flow_id, r.take_id, r.publication_id, r.next_take_id
    FROM trail AS r
    JOIN flow AS f ON r.flow_id = f.flow_id
    JOIN store.flow_root AS o ON r.publication_id = o.publication_id
    WHERE r.hop = 1
        AND CASE
            WHEN f.root_kind = 'publication' THEN f.root_id = r.publication_id
            WHEN f.root_kind = 'take' THEN f.root_id = -r.publication_id
            ELSE o.root_kind = 'callback_instance' AND o.root_id = f.root_id
        END
    QUALIFY row_number() OVER (
        PARTITION BY r.flow_id ORDER BY r.publications_rank DESC, r.takes_rank DESC
    ) = 1
),
hop (flow_id, hop, take_id, publication_id, previous_take_id, next_take_id) AS (
    SELECT
        flow_id,
        1::BIGINT,
        take_id, publication_id,
        NULL::BIGINT,
        next_take_id
    FROM whole
    UNION ALL
    SELECT h.flow_id, r.hop, r.take_id, r.publication_id, h.take_id, r.next_take_id
    FROM hop AS h
    JOIN trail AS r ON h.flow_id = r.flow_id AND h.hop + 1 = r.hop AND h.next_take_id = r.take_id
)
SELECT flow_id, hop, take_id, publication_id, previous_take_id, next_take_id FROM hop
