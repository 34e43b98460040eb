-- name: main.flow_component
-- kind: macro
-- description: Everything that a publication, take or callback run is connected with in any direction, itself included (depth 0).
-- grain: one row per vertex
-- needs: derive.graph_reachable, derive.flow_link_undirected
CREATE OR REPLACE MACRO main.flow_component(start_kind, start_id, max_depth := 100000) AS TABLE
SELECT kind, id, depth
FROM derive.graph_reachable('derive.flow_link_undirected', start_kind, start_id, max_depth := max_depth)
