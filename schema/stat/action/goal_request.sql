-- description: Goals that were sent to an action server, and what it answered.
-- grain: one row per goal and action server that took it; one per goal that none took
-- param: servers VARCHAR  Name of the rows of action servers, see main.goal
-- param: clients VARCHAR  Name of the rows of action clients, see main.goal
-- param: answers VARCHAR  Name of the rows of derive.goal_answer
CREATE OR REPLACE MACRO derive.goal_request(servers, clients, answers) AS TABLE
WITH answer AS (
    SELECT
        r.request_id,
        min(r.sent_ns) AS sent_ns,
        min(r.taken_ns) AS taken_ns,
        bool_or(a.is_accepted) AS is_accepted,
        min(a.status_ns) AS status_ns
    FROM store.response AS r
    LEFT JOIN query_table(answers) AS a ON r.response_id = a.response_id
    GROUP BY r.request_id
)
SELECT
    q.run_id,
    q.request_id AS goal_id,
    q.client_id AS action_client_id,
    q.service_id AS action_server_id,
    q.sent_ns, q.taken_ns,
    a.sent_ns AS answered_ns,
    a.taken_ns AS answer_taken_ns,
    a.is_accepted, a.status_ns,
    coalesce(c.action_name, s.action_name) AS action_name
FROM store.request AS q
LEFT JOIN query_table(clients) AS c ON q.client_id = c.action_client_id
LEFT JOIN query_table(servers) AS s ON q.service_id = s.action_server_id
LEFT JOIN answer AS a ON q.request_id = a.request_id
WHERE c.action_client_id IS NOT NULL OR s.action_server_id IS NOT NULL
