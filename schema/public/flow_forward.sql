-- description: Everything that a publication, take, callback instance, request or response caused,
--     directly or through other things, and the thing itself.
-- grain: one row per vertex
-- param: start_kind VARCHAR  'publication', 'take', 'callback_instance', 'request' or  'response'
-- param: start_id BIGINT  Identity of the vertex to start from
-- param: max_depth INTEGER = NULL  Maximum number of steps; NULL: no limit
-- column: kind VARCHAR  'publication', 'take', 'callback_instance', 'request' or 'response'
-- column: id BIGINT  Identity of the vertex
CREATE OR REPLACE MACRO main.flow_forward(start_kind, start_id, max_depth := NULL) AS TABLE
SELECT kind, id
FROM derive.graph_reachable('derive.flow_link', start_kind, start_id, max_depth := max_depth)
