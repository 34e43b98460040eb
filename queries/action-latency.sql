-- title: Latency of actions by action and client
-- description: How long goals of actions took, and by part: until the client had the answer, until
--     the first feedback, until the server had and sent the result, until the client had that.
--     Times to the answer and the result are on the client's clock, those of the server on its own.
--     Every part is measured if both its ends were traced and are known to be of one goal (view
--     goal). Before Kilted, ROS has no events of requests: then there are no rows.
-- grain: one row per action server and client
-- column: run_id, action_name
-- column: server VARCHAR [node]  Node of the action server; empty: not known
-- column: client VARCHAR [node]  Node of the action client; empty: not known
-- column: goals BIGINT               Goals sent or taken in the time window
-- column: accepted BIGINT            Goals that the server accepted
-- column: rejected BIGINT            Goals that the server rejected
-- column: not_answered BIGINT        Goals without a sign of an answer
-- column: asked BIGINT               Accepted goals whose result the client asked for
-- column: finished BIGINT            Goals whose result the client took
-- column: cancelled BIGINT           Goals for which the server accepted a request to cancel
-- column: doubtful BIGINT            Goals for which it is not known which result is theirs
-- column: overlapping BIGINT         Goals during which the server had another one: their feedback
--     is not known
-- column: feedback BIGINT            Feedback messages known to be of one of these goals
-- column: accept_median_ns BIGINT [ns]  Median time from the sending of the goal to the take of the
--     answer
-- column: accept_p95_ns BIGINT [ns]  95 % of these times are at most this
-- column: accept_p99_ns BIGINT [ns]  99 % of these times are at most this
-- column: accept_max_ns BIGINT [ns]  Longest of these times
-- column: first_feedback_median_ns BIGINT [ns]  Median time from the sending of the answer to the
--     first feedback
-- column: first_feedback_p95_ns BIGINT [ns]  95 % of these times are at most this
-- column: first_feedback_p99_ns BIGINT [ns]  99 % of these times are at most this
-- column: first_feedback_max_ns BIGINT [ns]  Longest of these times
-- column: execution_median_ns BIGINT [ns]  Median time from the sending of the answer to that of
--     the result
-- column: execution_p95_ns BIGINT [ns]  95 % of these times are at most this
-- column: execution_p99_ns BIGINT [ns]  99 % of these times are at most this
-- column: execution_max_ns BIGINT [ns]  Longest of these times
-- column: result_min_ns BIGINT [ns]  Shortest time from the sending of the goal to the take of the
--     result
-- column: result_median_ns BIGINT [ns]  Median of these times
-- column: result_mean_ns BIGINT [ns]  Mean of these times
-- column: result_p95_ns BIGINT [ns]  95 % of these times are at most this
-- column: result_p99_ns BIGINT [ns]  99 % of these times are at most this
-- column: result_max_ns BIGINT [ns]  Longest of these times
-- column: loss_affected BIGINT       Goals with a gap of a trace while they lasted
-- column: action_server_id BIGINT    Identity of the action server
-- column: action_client_id BIGINT    Identity of the action client
-- brief: action_name, client, result_median_ns, result_p99_ns, result_max_ns, goals, loss_affected,
--     result_p95_ns, accepted, rejected, finished, cancelled, server, accept_median_ns,
--     first_feedback_median_ns, execution_median_ns, not_answered, doubtful, overlapping
-- note: goals
WITH measured AS (
    SELECT
        run_id, action_name, action_server_id, action_client_id,
        count(*) AS goals,
        count(*) FILTER (is_accepted) AS accepted,
        count(*) FILTER (NOT is_accepted) AS rejected,
        count(*) FILTER (answered_ns IS NULL AND answer_taken_ns IS NULL) AS not_answered,
        count(result_request_id) AS asked,
        count(result_taken_ns) AS finished,
        count(cancel_accepted_ns) AS cancelled,
        count(*) FILTER (result_candidate_count > 1) AS doubtful,
        count(*) FILTER (is_overlapping) AS overlapping,
        coalesce(sum(feedback_count), 0)::BIGINT AS feedback,
        count(*) FILTER (is_loss_affected) AS loss_affected,
        quantile_disc(accept_latency_ns, [0.5, 0.95, 0.99, 1]) AS accept,
        quantile_disc(first_feedback_latency_ns, [0.5, 0.95, 0.99, 1]) AS first_feedback,
        quantile_disc(execution_ns, [0.5, 0.95, 0.99, 1]) AS execution,
        quantile_disc(latency_ns, [0, 0.5, 0.95, 0.99, 1]) AS result,
        round(avg(latency_ns))::BIGINT AS mean_ns
    FROM main.goal
    WHERE list_contains($runs, run_id)
        AND coalesce(sent_ns, taken_ns) >= $start_ns
        AND coalesce(sent_ns, taken_ns) < $end_ns
    GROUP BY run_id, action_name, action_server_id, action_client_id
)
SELECT
    m.run_id, m.action_name,
    main.node_label(sn.full_name, sp.name, sp.pid) AS server,
    main.node_label(cn.full_name, cp.name, cp.pid) AS client,
    m.goals, m.accepted, m.rejected, m.not_answered, m.asked, m.finished, m.cancelled, m.doubtful,
    m.overlapping, m.feedback,
    m.accept[1] AS accept_median_ns,
    m.accept[2] AS accept_p95_ns,
    m.accept[3] AS accept_p99_ns,
    m.accept[4] AS accept_max_ns,
    m.first_feedback[1] AS first_feedback_median_ns,
    m.first_feedback[2] AS first_feedback_p95_ns,
    m.first_feedback[3] AS first_feedback_p99_ns,
    m.first_feedback[4] AS first_feedback_max_ns,
    m.execution[1] AS execution_median_ns,
    m.execution[2] AS execution_p95_ns,
    m.execution[3] AS execution_p99_ns,
    m.execution[4] AS execution_max_ns,
    m.result[1] AS result_min_ns,
    m.result[2] AS result_median_ns,
    m.mean_ns AS result_mean_ns,
    m.result[3] AS result_p95_ns,
    m.result[4] AS result_p99_ns,
    m.result[5] AS result_max_ns,
    m.loss_affected, m.action_server_id, m.action_client_id
FROM measured AS m
LEFT JOIN main.service AS s ON m.action_server_id = s.service_id
LEFT JOIN main.process AS sp ON s.process_id = sp.process_id
LEFT JOIN main.node AS sn ON s.node_id = sn.node_id
LEFT JOIN main.client AS c ON m.action_client_id = c.client_id
LEFT JOIN main.process AS cp ON c.process_id = cp.process_id
LEFT JOIN main.node AS cn ON c.node_id = cn.node_id
ORDER BY
    m.run_id, result_p99_ns DESC NULLS LAST, m.action_name, server NULLS LAST,
    client NULLS LAST, m.action_server_id, m.action_client_id
