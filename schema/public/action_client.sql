-- description: Action clients: three clients of services and two subscriptions (action_server).
-- grain: one row per action client
-- column: run_id
-- column: action_client_id BIGINT  Identity of the action client: that of its client of send_goal
-- column: process_id, node_id, action_name
-- column: cancel_client_id BIGINT  Its client of cancel_goal
-- column: result_client_id BIGINT  Its client of get_result
-- column: feedback_subscription_id BIGINT  Its subscription to feedback, of the goals of all
--     clients
-- column: status_subscription_id BIGINT  Its subscription to the states of all goals
-- column: created_ns
-- column: goal_count BIGINT  Goals that it sent; NULL: requests have no events in the traces of its
--     host (before Kilted)
WITH sent AS (
    SELECT
        client_id,
        count(DISTINCT sequence_number) AS number
    FROM store.request
    GROUP BY client_id
)
SELECT
    a.run_id,
    a.goal_object_id AS action_client_id,
    a.process_id, a.node_id, a.action_name,
    a.cancel_object_id AS cancel_client_id,
    a.result_object_id AS result_client_id,
    a.feedback_object_id AS feedback_subscription_id,
    a.status_object_id AS status_subscription_id,
    c.created_ns,
    coalesce(q.number, CASE WHEN a.process_id IN (FROM derive.call_traced) THEN 0 END)
        AS goal_count
FROM derive.action_object('client', 'subscription') AS a
JOIN main.client AS c ON a.goal_object_id = c.client_id
LEFT JOIN sent AS q ON a.goal_object_id = q.client_id
