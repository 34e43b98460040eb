-- description: Requests to cancel goals that were accepted: between the take of such a request and
--     its response, the server publishes the status of its goals if it cancels one. Which goal that
--     is is known if there is only one.
-- grain: one row per request to cancel that was accepted
-- param: servers VARCHAR  Name of the rows of action servers, see main.goal
-- param: alone VARCHAR  Name of the rows of derive.goal_alone
CREATE OR REPLACE MACRO derive.goal_cancel(servers, alone) AS TABLE
WITH asked AS MATERIALIZED (
    SELECT
        q.run_id, q.request_id, s.action_server_id, s.status_publisher_id, r.sender_thread_id,
        q.sent_ns, q.taken_ns,
        r.sent_ns AS answered_ns
    FROM store.request AS q
    JOIN query_table(servers) AS s ON q.service_id = s.cancel_service_id
    JOIN store.response AS r ON q.request_id = r.request_id
    WHERE r.sender_thread_id = q.receiver_thread_id
),
-- A thread may take several requests at once: behind another response, the status may be of that.
published AS (
    SELECT
        a.request_id,
        min(b.start_ns) AS published_ns,
        arg_min(b.publication_id, b.start_ns) AS publication_id
    FROM asked AS a
    JOIN store.publication AS b
        ON a.status_publisher_id = b.publisher_id AND a.sender_thread_id = b.thread_id
        AND b.start_ns BETWEEN a.taken_ns AND a.answered_ns
    ANTI JOIN store.response AS r
        ON a.sender_thread_id = r.sender_thread_id AND r.sent_ns BETWEEN a.taken_ns AND b.start_ns
    GROUP BY a.request_id
)
SELECT a.run_id, a.request_id, a.action_server_id, p.publication_id, g.goal_id
FROM asked AS a
JOIN published AS p ON a.request_id = p.request_id
ASOF LEFT JOIN query_table(alone) AS g
    ON a.action_server_id = g.action_server_id AND p.published_ns >= g.at_ns
