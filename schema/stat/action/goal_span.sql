-- description: From when to when an action server was concerned with a goal that it accepted, or
--     may have: from its answer until it sent the result; without an end if no client asked for it.
--     Clients that ask late get it late. Of goals whose results cannot be told apart, the ends are
--     those of all, in some order. A result of a goal that the server was not seen to take is of
--     one that began in a gap of the server's host, or before the recording: the last gap before
--     the client took the answer, or before the result if that is not known.
-- grain: one row per goal that a server took and is not known to have rejected; one without a goal
--     per result of an unknown goal
-- param: servers VARCHAR  Name of the rows of action servers, see main.goal
-- param: goals VARCHAR  Name of the rows of derive.goal_request
-- param: results VARCHAR  Name of the rows of derive.goal_result
CREATE OR REPLACE MACRO derive.goal_span(servers, goals, results) AS TABLE
WITH unseen AS (
    SELECT
        r.run_id, s.action_server_id, p.host_id, r.sent_ns,
        least(g.answer_taken_ns, r.sent_ns) AS begun_ns,
        r.request_id IS NOT NULL AND g.goal_id IS NULL AS is_surplus
    FROM store.response AS r
    JOIN query_table(servers) AS s ON r.service_id = s.result_service_id
    JOIN store.process AS p ON s.process_id = p.process_id
    LEFT JOIN query_table(results) AS q ON r.request_id = q.request_id
    LEFT JOIN query_table(goals) AS g ON q.goal_id = g.goal_id
    WHERE g.taken_ns IS NULL
),
span AS (
    SELECT
        g.run_id, g.goal_id, g.action_server_id,
        coalesce(g.answered_ns, g.taken_ns) AS start_ns,
        min(r.sent_ns) AS end_ns,
        coalesce(any_value(p.candidate_count), 0) <= 1 AS is_end_certain
    FROM query_table(goals) AS g
    LEFT JOIN query_table(results) AS p ON g.goal_id = p.goal_id
    LEFT JOIN store.response AS r ON p.request_id = r.request_id
    WHERE g.taken_ns IS NOT NULL AND g.is_accepted IS DISTINCT FROM false
    GROUP BY g.run_id, g.goal_id, g.action_server_id, g.answered_ns, g.taken_ns
    UNION ALL
    SELECT
        u.run_id, NULL, u.action_server_id,
        coalesce(l.start_ns, 0),
        u.sent_ns, false
    FROM unseen AS u
    ASOF LEFT JOIN derive.host_gap AS l ON u.host_id = l.host_id AND u.begun_ns >= l.start_ns
    -- A client may ask for a result once more.
    WHERE NOT u.is_surplus OR l.start_ns IS NOT NULL
),
placed AS (
    SELECT
        *,
        coalesce(bool_or(end_ns IS NULL) OVER before OR max(end_ns) OVER before > start_ns, false)
            AS is_begun_during_other,
        lead(start_ns) OVER ordered AS next_start_ns
    FROM span
    WINDOW
        ordered AS (PARTITION BY action_server_id ORDER BY start_ns, goal_id),
        before AS (
            PARTITION BY action_server_id ORDER BY start_ns, goal_id
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        )
)
SELECT
    *,
    is_begun_during_other
    OR (next_start_ns IS NOT NULL AND coalesce(next_start_ns < end_ns, true)) AS is_overlapping
FROM placed
