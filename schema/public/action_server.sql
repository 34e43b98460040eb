-- description: Action servers. An action is three services and two topics: NAME/_action/send_goal,
--     cancel_goal and get_result, NAME/_action/feedback and status.
-- grain: one row per action server
-- column: run_id
-- column: action_server_id BIGINT  Identity of the action server: that of its service send_goal
-- column: process_id, node_id, action_name
-- column: cancel_service_id BIGINT  Its service cancel_goal
-- column: result_service_id BIGINT  Its service get_result
-- column: feedback_publisher_id BIGINT  Its publisher of feedback
-- column: status_publisher_id BIGINT  Its publisher of the states of its goals
-- column: created_ns
-- column: goal_count BIGINT  Goals that it took; NULL: requests have no events in the traces of its
--     host (before Kilted)
-- column: feedback_count BIGINT  Feedback messages that it published, of all goals
-- column: status_count BIGINT  Status messages that it published
WITH taken AS (
    SELECT
        service_id,
        count(*) AS number
    FROM store.request
    WHERE taken_ns IS NOT NULL
    GROUP BY service_id
),
published AS (
    SELECT
        publisher_id,
        count(*) AS number
    FROM store.publication
    WHERE publisher_id IN (SELECT object_id FROM derive.action_endpoint WHERE kind = 'publisher')
    GROUP BY publisher_id
)
SELECT
    a.run_id,
    a.goal_object_id AS action_server_id,
    a.process_id, a.node_id, a.action_name,
    a.cancel_object_id AS cancel_service_id,
    a.result_object_id AS result_service_id,
    a.feedback_object_id AS feedback_publisher_id,
    a.status_object_id AS status_publisher_id,
    s.created_ns,
    coalesce(q.number, CASE WHEN a.process_id IN (FROM derive.call_traced) THEN 0 END)
        AS goal_count,
    coalesce(f.number, 0) AS feedback_count,
    coalesce(t.number, 0) AS status_count
FROM derive.action_object('service', 'publisher') AS a
JOIN main.service AS s ON a.goal_object_id = s.service_id
LEFT JOIN taken AS q ON a.goal_object_id = q.service_id
LEFT JOIN published AS f ON a.feedback_object_id = f.publisher_id
LEFT JOIN published AS t ON a.status_object_id = t.publisher_id
