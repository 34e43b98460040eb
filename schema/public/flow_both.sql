-- description: The flow of one message: a publication, take, callback instance, request or
--     response, all that it caused, and all that caused it. Other effects of its causes are
--     omitted.
-- grain: one row per vertex
-- param: start_kind, start_id
-- param: max_depth INTEGER = NULL  Maximum number of steps; NULL: no limit
-- column: kind, id
CREATE OR REPLACE MACRO main.flow_both(start_kind, start_id, max_depth := NULL) AS TABLE
SELECT kind, id FROM main.flow_forward(start_kind, start_id, max_depth := max_depth)
UNION
SELECT kind, id FROM main.flow_backward(start_kind, start_id, max_depth := max_depth)
