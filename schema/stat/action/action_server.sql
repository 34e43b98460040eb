-- name: derive.action_server
-- kind: macro
-- description: Action servers, put together from their objects: rcl creates these one right after
--     the other, the one of send_goal first. So the others are the first ones of their names that
--     the process created from then on.
-- grain: one row per action server
-- param: endpoints VARCHAR  Name of the rows of derive.action_endpoint
CREATE OR REPLACE MACRO derive.action_server(endpoints) AS TABLE
SELECT
    g.run_id, g.process_id, g.node_id, g.action_name, g.created_ns,
    g.object_id AS action_server_id,
    c.object_id AS cancel_service_id,
    r.object_id AS result_service_id,
    f.object_id AS feedback_publisher_id,
    s.object_id AS status_publisher_id
FROM query_table(endpoints) AS g
ASOF LEFT JOIN (FROM query_table(endpoints) WHERE kind = 'service' AND part = 'cancel_goal') AS c
    ON g.process_id = c.process_id AND g.action_name = c.action_name
    AND g.created_ns <= c.created_ns
ASOF LEFT JOIN (FROM query_table(endpoints) WHERE kind = 'service' AND part = 'get_result') AS r
    ON g.process_id = r.process_id AND g.action_name = r.action_name
    AND g.created_ns <= r.created_ns
ASOF LEFT JOIN (FROM query_table(endpoints) WHERE kind = 'publisher' AND part = 'feedback') AS f
    ON g.process_id = f.process_id AND g.action_name = f.action_name
    AND g.created_ns <= f.created_ns
ASOF LEFT JOIN (FROM query_table(endpoints) WHERE kind = 'publisher' AND part = 'status') AS s
    ON g.process_id = s.process_id AND g.action_name = s.action_name
    AND g.created_ns <= s.created_ns
WHERE g.kind = 'service' AND g.part = 'send_goal'
