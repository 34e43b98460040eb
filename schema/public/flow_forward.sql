-- name: main.flow_forward
-- kind: macro
-- description: Everything that a publication, take or callback run causes, directly or through others, itself included (depth 0).
-- grain: one row per vertex
-- needs: derive.graph_reachable, derive.flow_link
CREATE OR REPLACE MACRO main.flow_forward(start_kind, start_id, max_depth := 100000) AS TABLE
SELECT kind, id, depth
FROM derive.graph_reachable('derive.flow_link', start_kind, start_id, max_depth := max_depth)
