-- description: Feedback of action servers, and which goal it is of: that is not in the trace, so it
--     is known only while the server is concerned with one goal and no other.
-- grain: one row per feedback message that an action server published
-- param: servers VARCHAR  Name of the rows of action servers, see main.goal
-- param: alone VARCHAR  Name of the rows of derive.goal_alone
CREATE OR REPLACE MACRO derive.goal_feedback(servers, alone) AS TABLE
SELECT b.run_id, b.publication_id, s.action_server_id, b.start_ns, a.goal_id
FROM store.publication AS b
JOIN query_table(servers) AS s ON b.publisher_id = s.feedback_publisher_id
ASOF LEFT JOIN query_table(alone) AS a
    ON s.action_server_id = a.action_server_id AND b.start_ns >= a.at_ns
