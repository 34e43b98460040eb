-- description: What an action server said to a goal, as far as its thread shows. Once it has
--     accepted one, the next thing that the same thread does is to publish the status of its goals:
--     rclcpp and rclpy do nothing in between. If the thread goes on with anything else, the goal
--     was rejected. A thread without executor events and callbacks (rclpy) may also have turned to
--     another goal that it executes, and may publish its status: what other goals were open decides
--     (main.goal). Where events may be missing between the two, where the thread does nothing more,
--     and in processes that are several, it is not known.
-- grain: one row per response to a goal that an action server sent
-- column: is_accepted BOOLEAN  Whether the goal was accepted; NULL: not known
-- column: status_ns BIGINT [epoch ns]  Where the status of another goal looks the same: when the
--     thread published the status
-- param: servers VARCHAR  Name of the rows of action servers, see main.goal
CREATE OR REPLACE MACRO derive.goal_answer(servers) AS TABLE
WITH answer AS MATERIALIZED (
    SELECT
        r.response_id,
        r.sender_thread_id AS thread_id,
        r.sent_ns, s.status_publisher_id,
        coalesce(p.is_ambiguous, false) AS is_ambiguous
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
    SELECT
        thread_id, at_ns,
        NULL::BIGINT AS publisher_id
    FROM executing
    UNION ALL
    SELECT thread_id, start_ns, publisher_id
    FROM store.publication
    UNION ALL
    SELECT thread_id, taken_ns, NULL
    FROM store.take
    UNION ALL
    SELECT sender_thread_id, sent_ns, NULL
    FROM call
    UNION ALL
    SELECT receiver_thread_id, taken_ns, NULL
    FROM call
),
followed AS (
    SELECT
        a.response_id, a.thread_id, d.at_ns,
        CASE
            WHEN a.status_publisher_id IS NOT NULL AND NOT a.is_ambiguous AND d.at_ns IS NOT NULL
                AND coalesce(b.resumed_ns <= a.sent_ns, true)
                THEN d.publisher_id IS NOT DISTINCT FROM a.status_publisher_id
        END AS is_followed_by_status
    FROM answer AS a
    ASOF LEFT JOIN (FROM deed WHERE thread_id IN (SELECT thread_id FROM answer)) AS d
        ON a.thread_id = d.thread_id AND a.sent_ns < d.at_ns
    ASOF LEFT JOIN store.thread_break AS b ON a.thread_id = b.thread_id AND d.at_ns >= b.resumed_ns
)
SELECT
    response_id,
    CASE
        WHEN NOT is_followed_by_status OR thread_id IN (SELECT thread_id FROM executing)
            THEN is_followed_by_status
    END AS is_accepted,
    CASE
        WHEN is_followed_by_status AND thread_id NOT IN (SELECT thread_id FROM executing)
            THEN at_ns
    END AS status_ns
FROM followed
