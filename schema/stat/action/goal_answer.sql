-- name: derive.goal_answer
-- kind: macro
-- description: What an action server said to a goal. Once it has accepted one, the next thing that
--     the same thread does is to publish the status of its goals: rclcpp and rclpy do nothing in
--     between. If the thread goes on with anything else, the goal was rejected. A thread without
--     executor events and callbacks (rclpy) may also have turned to another goal that it executes,
--     and may publish its status: there, the status tells only if no other goal is open, and none
--     was answered in between. Where events may be missing between the two, where the thread does
--     nothing more, and in processes that are several, it is not known.
-- grain: one row per response to a goal that an action server sent
-- param: servers VARCHAR  Name of the rows of action servers, see main.goal
CREATE OR REPLACE MACRO derive.goal_answer(servers) AS TABLE
WITH answer AS MATERIALIZED (
    SELECT
        r.response_id, r.sender_thread_id AS thread_id, r.sent_ns, s.action_server_id,
        s.status_publisher_id, coalesce(p.is_ambiguous, false) AS is_ambiguous,
        lead(r.sent_ns) OVER (
            PARTITION BY s.action_server_id ORDER BY r.sent_ns, r.response_id
        ) AS next_sent_ns
    FROM store.response AS r
    JOIN query_table(servers) AS s ON r.service_id = s.action_server_id
    JOIN store.process AS p ON s.process_id = p.process_id
),
executing AS MATERIALIZED (
    SELECT thread_id, at_ns
    FROM derive.thread_turn
    WHERE thread_id IN (SELECT thread_id FROM answer)
),
call AS (
    SELECT sender_thread_id, sent_ns, receiver_thread_id, taken_ns FROM store.request
    UNION ALL
    SELECT sender_thread_id, sent_ns, receiver_thread_id, taken_ns FROM store.response
),
deed AS (
    SELECT thread_id, at_ns, NULL::BIGINT AS publisher_id FROM executing
    UNION ALL
    SELECT thread_id, start_ns, publisher_id FROM store.publication
    UNION ALL
    SELECT thread_id, taken_ns, NULL FROM store.take
    UNION ALL
    SELECT sender_thread_id, sent_ns, NULL FROM call
    UNION ALL
    SELECT receiver_thread_id, taken_ns, NULL FROM call
),
followed AS (
    SELECT
        a.response_id, a.thread_id, a.action_server_id, a.sent_ns,
        coalesce(a.next_sent_ns < d.at_ns, false) AS is_other_answered,
        CASE
            WHEN a.status_publisher_id IS NOT NULL AND NOT a.is_ambiguous AND d.at_ns IS NOT NULL
                AND coalesce(b.resumed_ns <= a.sent_ns, true)
                THEN d.publisher_id IS NOT DISTINCT FROM a.status_publisher_id
        END AS is_followed_by_status
    FROM answer AS a
    ASOF LEFT JOIN (FROM deed WHERE thread_id IN (SELECT thread_id FROM answer)) AS d
        ON a.thread_id = d.thread_id AND a.sent_ns < d.at_ns
    ASOF LEFT JOIN store.thread_break AS b
        ON a.thread_id = b.thread_id AND d.at_ns >= b.resumed_ns
),
-- Goals that may be open then: all that were not rejected, without those whose results were sent. A
-- result that was asked for before the recording, or in a gap, is of a goal that was open since.
step AS (
    SELECT action_server_id, sent_ns, response_id, 1 AS change
    FROM followed
    WHERE is_followed_by_status IS DISTINCT FROM false
    UNION ALL
    SELECT s.action_server_id, r.sent_ns, r.response_id, -1
    FROM store.response AS r
    JOIN query_table(servers) AS s ON r.service_id = s.result_service_id
    UNION ALL
    SELECT s.action_server_id, coalesce(l.start_ns, 0), NULL, 1
    FROM store.response AS r
    JOIN query_table(servers) AS s ON r.service_id = s.result_service_id
    JOIN store.process AS p ON s.process_id = p.process_id
    ASOF LEFT JOIN derive.host_gap AS l ON p.host_id = l.host_id AND r.sent_ns >= l.start_ns
    WHERE r.request_id IS NULL
),
summed AS (
    SELECT *, sum(change) OVER earlier AS balance
    FROM step
    WINDOW earlier AS (
        PARTITION BY action_server_id ORDER BY sent_ns, response_id ROWS UNBOUNDED PRECEDING
    )
),
-- Any other result of no known goal leaves none open: the sum begins anew.
counted AS (
    SELECT response_id, balance - least(0, min(balance) OVER earlier) AS open
    FROM summed
    WINDOW earlier AS (
        PARTITION BY action_server_id ORDER BY sent_ns, response_id ROWS UNBOUNDED PRECEDING
    )
)
SELECT
    f.response_id,
    CASE
        WHEN NOT f.is_followed_by_status
            OR (c.open = 1 AND NOT f.is_other_answered)
            OR f.thread_id IN (SELECT thread_id FROM executing)
            THEN f.is_followed_by_status
    END AS is_accepted
FROM followed AS f
LEFT JOIN counted AS c ON f.response_id = c.response_id
