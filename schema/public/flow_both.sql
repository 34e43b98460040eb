-- name: main.flow_both
-- kind: macro
-- description: The flow of one message: everything that a publication, take or callback run causes
--     or is caused by. Depth is positive towards effects, negative towards causes.
-- grain: one row per vertex
-- needs: main.flow_forward, main.flow_backward
CREATE OR REPLACE MACRO main.flow_both(start_kind, start_id, max_depth := 100000) AS TABLE
SELECT kind, id, depth
FROM main.flow_forward(start_kind, start_id, max_depth := max_depth)
UNION ALL
SELECT kind, id, -depth
FROM main.flow_backward(start_kind, start_id, max_depth := max_depth)
WHERE depth > 0
