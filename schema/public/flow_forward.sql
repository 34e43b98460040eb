-- description: Everything that a publication, take, callback instance, request or response caused,
--     directly or through other things, and the thing itself.
-- grain: one row per vertex
-- param: start_kind, start_id
-- param: max_depth INTEGER = NULL  Maximum number of steps; NULL: no limit
-- column: kind, id
CREATE OR REPLACE MACRO main.flow_forward(start_kind, start_id, max_depth := NULL) AS TABLE
SELECT kind, id
FROM derive.graph_reachable('derive.flow_link', start_kind, start_id, max_depth := max_depth)
