-- name: main.flow_backward
-- kind: macro
-- description: Everything that a publication, take or callback run is caused by, directly or through others, itself included (depth 0).
-- grain: one row per vertex
-- needs: derive.graph_reachable, derive.flow_link_reversed
CREATE OR REPLACE MACRO main.flow_backward(start_kind, start_id, max_depth := 100000) AS TABLE
SELECT kind, id, depth
FROM derive.graph_reachable('derive.flow_link_reversed', start_kind, start_id, max_depth := max_depth)
