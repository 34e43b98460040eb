-- description: Goals of actions, from sending to result, as far as services and topics of the
--     action show it (Kilted and later). The identity of a goal is not in the trace, and neither is
--     how it ended. So a result is known to be of a goal if the client asked for it in the callback
--     of the answer, or if no other goal of that client was open that may have been accepted;
--     feedback and requests to cancel if the server was concerned with no other goal at that time.
-- grain: one row per goal and action server that took it; one per goal that none took
-- column: run_id
-- column: goal_id BIGINT  Identity of the goal: that of the request that sent it
-- column: action_name
-- column: action_client_id BIGINT  Action client that sent it; NULL: not traced
-- column: action_server_id BIGINT  Action server that took it; NULL: none was seen to
-- column: sent_ns BIGINT [epoch ns]  The client sent it
-- column: taken_ns BIGINT [epoch ns]  The server took it
-- column: answered_ns BIGINT [epoch ns]  The server said whether it accepts it; where it does,
--     from then on it may execute it
-- column: answer_taken_ns BIGINT [epoch ns]  The client took that answer
-- column: is_accepted BOOLEAN  Whether the server accepted it: it published its status right after
--     its answer, or the client asked for the result; NULL: not known
-- column: result_asked_ns BIGINT [epoch ns]  The client asked for the result
-- column: result_sent_ns BIGINT [epoch ns]  The server sent the result: when there was one, and
--     the client had asked
-- column: result_taken_ns BIGINT [epoch ns]  The client took the result
-- column: result_request_id BIGINT  Request for the result
-- column: result_candidate_count BIGINT  0: no request for the result; 1: its request is known; 2
--     or more: so many goals compete for it, and the columns of the result are NULL; NULL: not
--     accepted, or no answer
-- column: feedback_count BIGINT  Feedback messages published while the server was concerned with
--     no other goal; NULL: the trace shows no such time
-- column: first_feedback_ns BIGINT [epoch ns]  The first of them; NULL: none, or another goal was
--     open meanwhile
-- column: last_feedback_ns BIGINT [epoch ns]  The last of them, likewise
-- column: is_overlapping BOOLEAN  The server had another goal meanwhile: some feedback and requests
--     to cancel may not be known
-- column: cancel_asked_ns BIGINT [epoch ns]  A client asked to cancel it, and the server accepted
--     that
-- column: cancel_accepted_ns BIGINT [epoch ns]  The server published that it cancels it
-- column: accept_latency_ns BIGINT [ns]  From sending it to the take of the answer, on the client's
--     clock
-- column: execution_ns BIGINT [ns]  From the answer to the sending of the result, on the server's
--     clock
-- column: first_feedback_latency_ns BIGINT [ns]  From the answer to the first feedback, on the
--     server's clock
-- column: latency_ns BIGINT [ns]  From sending it to the take of its result, on the client's clock
-- column: is_loss_affected BOOLEAN  A gap of the client's host or the server's lies between these
--     moments
WITH server AS MATERIALIZED (
    SELECT
        *,
        goal_object_id AS action_server_id,
        cancel_object_id AS cancel_service_id,
        result_object_id AS result_service_id,
        feedback_object_id AS feedback_publisher_id,
        status_object_id AS status_publisher_id
    FROM derive.action_object('service', 'publisher')
),
client AS MATERIALIZED (
    SELECT
        *,
        goal_object_id AS action_client_id,
        result_object_id AS result_client_id
    FROM derive.action_object('client', 'subscription')
),
answered AS MATERIALIZED (FROM derive.goal_answer('server')),
request AS MATERIALIZED (FROM derive.goal_request('server', 'client', 'answered')),
paired AS MATERIALIZED (FROM derive.goal_result('server', 'client', 'request')),
span AS MATERIALIZED (FROM derive.goal_span('server', 'request', 'paired')),
alone AS MATERIALIZED (FROM derive.goal_alone('span')),
answer AS (
    SELECT
        request_id,
        min(sent_ns) AS sent_ns,
        min(taken_ns) AS taken_ns
    FROM main.response
    GROUP BY request_id
),
result AS (
    SELECT
        p.goal_id, p.request_id,
        q.sent_ns AS asked_ns,
        a.sent_ns, a.taken_ns
    FROM paired AS p
    JOIN main.request AS q ON p.request_id = q.request_id
    LEFT JOIN answer AS a ON p.request_id = a.request_id
    WHERE p.candidate_count = 1
),
possible AS (
    SELECT
        goal_id,
        any_value(candidate_count) AS candidate_count
    FROM paired
    GROUP BY goal_id
),
-- Feedback names no goal in the trace: it counts where the server has one goal alone.
told AS (
    SELECT
        a.goal_id,
        count(*) AS number,
        min(b.start_ns) AS first_ns,
        max(b.start_ns) AS last_ns
    FROM store.publication AS f
    JOIN server AS s ON f.publisher_id = s.feedback_publisher_id
    ASOF JOIN alone AS a ON s.action_server_id = a.action_server_id AND f.start_ns >= a.at_ns
    JOIN main.publication AS b ON f.publication_id = b.publication_id
    GROUP BY a.goal_id
),
cancelled AS (
    SELECT
        c.goal_id,
        min(q.sent_ns) AS asked_ns,
        min(b.start_ns) AS accepted_ns
    FROM derive.goal_cancel('server', 'alone') AS c
    JOIN main.request AS q ON c.request_id = q.request_id
    JOIN main.publication AS b ON c.publication_id = b.publication_id
    GROUP BY c.goal_id
),
timed AS (
    SELECT
        g.run_id, g.goal_id, g.action_name, g.action_client_id, g.action_server_id, q.sent_ns,
        q.taken_ns,
        a.sent_ns AS answered_ns,
        a.taken_ns AS answer_taken_ns,
        -- A status that a thread publishes right after its answer is of that goal if no other one
        -- was open, and none was answered in between.
        coalesce(
            g.is_accepted,
            CASE
                WHEN r.goal_id IS NOT NULL
                    OR (
                        g.status_ns IS NOT NULL
                        AND NOT s.is_begun_during_other
                        AND coalesce(s.next_start_ns >= g.status_ns, true)
                    )
                    THEN true
            END
        ) AS is_accepted,
        r.asked_ns AS result_asked_ns,
        r.sent_ns AS result_sent_ns,
        r.taken_ns AS result_taken_ns,
        r.request_id AS result_request_id,
        p.candidate_count AS result_candidate_count,
        CASE WHEN s.is_end_certain THEN coalesce(t.number, 0) END AS feedback_count,
        CASE WHEN NOT s.is_overlapping THEN t.first_ns END AS first_feedback_ns,
        CASE WHEN NOT s.is_overlapping THEN t.last_ns END AS last_feedback_ns,
        coalesce(s.is_overlapping, false) AS is_overlapping,
        c.asked_ns AS cancel_asked_ns,
        c.accepted_ns AS cancel_accepted_ns
    FROM request AS g
    JOIN main.request AS q ON g.goal_id = q.request_id
    LEFT JOIN answer AS a ON g.goal_id = a.request_id
    LEFT JOIN result AS r ON g.goal_id = r.goal_id
    LEFT JOIN possible AS p ON g.goal_id = p.goal_id
    LEFT JOIN span AS s ON g.goal_id = s.goal_id
    LEFT JOIN told AS t ON g.goal_id = t.goal_id
    LEFT JOIN cancelled AS c ON g.goal_id = c.goal_id
),
-- Where the client or the server of a goal is not known, each one of the action may be it.
party AS (
    SELECT
        run_id, action_name, action_client_id,
        NULL AS action_server_id,
        process_id
    FROM client
    UNION ALL
    SELECT run_id, action_name, NULL, action_server_id, process_id
    FROM server
),
torn AS (
    SELECT t.goal_id
    FROM timed AS t
    JOIN party AS y
        ON t.run_id = y.run_id
        AND t.action_name = y.action_name
        AND coalesce(t.action_client_id = y.action_client_id, true)
        AND coalesce(t.action_server_id = y.action_server_id, true)
    JOIN store.process AS p ON y.process_id = p.process_id
    JOIN store.trace AS x ON p.host_id = x.host_id
    JOIN main.gap AS l ON x.trace_id = l.trace_id
    WHERE x.domain IS DISTINCT FROM 'kernel'
        AND l.end_ns >= least(t.sent_ns, t.taken_ns)
        AND l.start_ns <= greatest(
            t.sent_ns, t.taken_ns, t.answered_ns, t.answer_taken_ns, t.result_asked_ns,
            t.result_sent_ns, t.result_taken_ns, t.last_feedback_ns
        )
)
SELECT
    run_id, goal_id, action_name, action_client_id, action_server_id, sent_ns, taken_ns,
    answered_ns, answer_taken_ns, is_accepted, result_asked_ns, result_sent_ns, result_taken_ns,
    result_request_id, result_candidate_count, feedback_count, first_feedback_ns, last_feedback_ns,
    is_overlapping, cancel_asked_ns, cancel_accepted_ns,
    answer_taken_ns - sent_ns AS accept_latency_ns,
    result_sent_ns - answered_ns AS execution_ns,
    first_feedback_ns - answered_ns AS first_feedback_latency_ns,
    result_taken_ns - sent_ns AS latency_ns,
    goal_id IN (FROM torn) AS is_loss_affected
FROM timed
