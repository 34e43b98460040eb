-- description: Action servers or clients, put together from their objects. rcl creates these one
--     right after the other, the one of send_goal first: the others are the first of their names
--     that the process created at that time or later.
-- grain: one row per action server, or per action client
-- param: of_calls VARCHAR  Kind of the objects of calls: 'service' of servers, 'client' of clients
-- param: of_topics VARCHAR  Kind of the objects of topics: 'publisher' of servers,
--     'subscription' of clients
CREATE OR REPLACE MACRO derive.action_object(of_calls, of_topics) AS TABLE
WITH endpoint AS MATERIALIZED (FROM derive.action_endpoint)
SELECT
    g.run_id, g.process_id, g.node_id, g.action_name, g.created_ns, g.object_id AS goal_object_id,
    c.object_id AS cancel_object_id, r.object_id AS result_object_id,
    f.object_id AS feedback_object_id, s.object_id AS status_object_id
FROM endpoint AS g
ASOF LEFT JOIN (FROM endpoint WHERE kind = of_calls AND part = 'cancel_goal') AS c
    ON g.process_id = c.process_id AND g.action_name = c.action_name
    AND g.created_ns <= c.created_ns
ASOF LEFT JOIN (FROM endpoint WHERE kind = of_calls AND part = 'get_result') AS r
    ON g.process_id = r.process_id AND g.action_name = r.action_name
    AND g.created_ns <= r.created_ns
ASOF LEFT JOIN (FROM endpoint WHERE kind = of_topics AND part = 'feedback') AS f
    ON g.process_id = f.process_id AND g.action_name = f.action_name
    AND g.created_ns <= f.created_ns
ASOF LEFT JOIN (FROM endpoint WHERE kind = of_topics AND part = 'status') AS s
    ON g.process_id = s.process_id AND g.action_name = s.action_name
    AND g.created_ns <= s.created_ns
WHERE g.kind = of_calls AND g.part = 'send_goal'
