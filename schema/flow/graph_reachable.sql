-- name: derive.graph_reachable
-- kind: macro
-- description: The vertices that can be reached from one vertex along the edges of a table or view
--     with columns from_kind, from_id, to_kind, to_id. Each vertex comes once; the walk ends on
--     any graph, at the latest after max_depth steps.
-- grain: one row per vertex
-- needs: derive.flow_link
CREATE OR REPLACE MACRO derive.graph_reachable(
    edges, start_kind, start_id, max_depth := 100000
) AS TABLE
WITH RECURSIVE edge AS MATERIALIZED (
    SELECT from_kind, from_id, to_kind, to_id FROM query_table(edges)
),
reached (kind, id, depth) USING KEY (kind, id) AS (
    SELECT start_kind::VARCHAR, start_id::BIGINT, 0
    UNION
    SELECT e.to_kind, e.to_id, min(r.depth) + 1
    FROM reached AS r
    JOIN edge AS e ON r.kind = e.from_kind AND r.id = e.from_id
    WHERE r.depth < max_depth
    GROUP BY e.to_kind, e.to_id
)
SELECT kind, id, depth FROM reached
