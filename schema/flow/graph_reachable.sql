-- description: The vertices that can be reached from one vertex along the edges of a table or
--     view with columns from_kind, from_id, to_kind, to_id. Each vertex comes once; the walk ends
--     on any graph. Without max_depth, the cost grows with the edges alone. With it, the cost
--     also grows with the depth, since every step has to look at all that was reached before.
-- grain: one row per vertex
CREATE OR REPLACE MACRO derive.graph_reachable(
    edges, start_kind, start_id, max_depth := NULL
) AS TABLE
-- The edges must not be looked for again at every step. DuckDB computes what is used twice only
-- once; the word MATERIALIZED alone gets lost when a file of this storage version is opened again.
WITH RECURSIVE edge AS MATERIALIZED (
    SELECT from_kind, from_id, to_kind, to_id FROM query_table(edges)
),
known AS (SELECT count(*) AS edge_count FROM edge),
reached (kind, id) AS (
    SELECT
        start_kind::VARCHAR,
        start_id::BIGINT
    FROM known
    WHERE max_depth IS NULL AND edge_count >= 0
    UNION
    SELECT e.to_kind, e.to_id
    FROM reached AS r
    JOIN edge AS e ON r.kind = e.from_kind AND r.id = e.from_id
),
near (kind, id, depth) USING KEY (kind, id) AS (
    SELECT
        start_kind::VARCHAR,
        start_id::BIGINT,
        0
    FROM known
    WHERE max_depth IS NOT NULL AND edge_count >= 0
    UNION
    SELECT
        e.to_kind, e.to_id,
        min(n.depth) + 1
    FROM near AS n
    JOIN edge AS e ON n.kind = e.from_kind AND n.id = e.from_id
    ANTI JOIN recurring.near AS k ON e.to_kind = k.kind AND e.to_id = k.id
    WHERE n.depth < max_depth
    GROUP BY e.to_kind, e.to_id
)
SELECT kind, id FROM reached
UNION ALL
SELECT kind, id FROM near
