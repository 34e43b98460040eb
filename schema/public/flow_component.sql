-- name: main.flow_component
-- kind: macro
-- description: Everything that is connected with a publication, take, callback instance, request or
--     response in any direction, and the thing itself.
-- grain: one row per vertex
-- param: start_kind VARCHAR  'publication', 'take', 'callback_instance', 'request' or
--     'response'
-- param: start_id BIGINT  Identity of the vertex to start from
-- param: max_depth INTEGER = NULL  Maximum number of steps; NULL: no limit
-- column: kind VARCHAR  'publication', 'take', 'callback_instance', 'request' or
--     'response'
-- column: id BIGINT  Identity of the vertex
CREATE OR REPLACE MACRO main.flow_component(start_kind, start_id, max_depth := NULL) AS TABLE
SELECT kind, id
FROM derive.graph_reachable(
    'derive.flow_link_undirected', start_kind, start_id, max_depth := max_depth
)
