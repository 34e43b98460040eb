-- description: Everything that is connected with a publication, take, callback instance, request or
--     response in any direction, and the thing itself.
-- grain: one row per vertex
-- param: start_kind, start_id
-- param: max_depth INTEGER = NULL  Maximum number of steps; NULL: no limit
-- column: kind, id
CREATE OR REPLACE MACRO main.flow_component(start_kind, start_id, max_depth := NULL) AS TABLE
SELECT kind, id
FROM derive.graph_reachable(
    'derive.flow_link_undirected', start_kind, start_id, max_depth := max_depth
)
