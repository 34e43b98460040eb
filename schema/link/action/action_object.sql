-- description: Action servers or clients, put together from their objects. rcl creates these one
--     right after the other, the one of send_goal first: the others are the first of their names
--     that the process created at that time or later.
-- grain: one row per action server, or per action client
-- param: of_calls VARCHAR  Kind of the objects of calls: 'service' of servers, 'client' of clients
-- param: of_topics VARCHAR  Kind of the objects of topics: 'publisher' of servers,
--     'subscription' of clients
CREATE OR REPLACE MACRO derive.action_object(of_calls, of_topics) AS TABLE
WITH endpoint AS MATERIALIZED (
    FROM derive.action_endpoint WHERE kind IN (of_calls, of_topics)
)
SELECT
    g.run_id, g.process_id, g.node_id, g.action_name, g.created_ns,
    g.object_id AS goal_object_id,
    any_value(o.object_id) FILTER (o.part = 'cancel_goal') AS cancel_object_id,
    any_value(o.object_id) FILTER (o.part = 'get_result') AS result_object_id,
    any_value(o.object_id) FILTER (o.part = 'feedback') AS feedback_object_id,
    any_value(o.object_id) FILTER (o.part = 'status') AS status_object_id
FROM (
    SELECT
        *,
        unnest(['cancel_goal', 'get_result', 'feedback', 'status']) AS other
    FROM endpoint
    WHERE kind = of_calls AND part = 'send_goal'
) AS g
ASOF LEFT JOIN endpoint AS o
    ON g.process_id = o.process_id
    AND g.action_name = o.action_name
    AND g.other = o.part
    AND g.created_ns <= o.created_ns
GROUP BY g.run_id, g.process_id, g.node_id, g.action_name, g.created_ns, g.object_id
