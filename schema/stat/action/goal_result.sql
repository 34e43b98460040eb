-- description: Which goal a request for a result belongs to. The number of the goal is not in the
--     trace. A request that a thread sent after it took the answer to a goal, in the same turn, is
--     for that goal (derive.certain_call). Else what counts is which goals of the client are open:
--     accepted, and no request asked for their result. While only one is, a request is for that
--     one. If several are, each request may be for each of them, until all of them were asked for:
--     these goals are one block. In it, the order pairs goals and requests, so that the number of
--     goals that are still worked on is right, but not which.
-- grain: one row per goal that may have been accepted; one per request beyond these
-- param: servers VARCHAR  Name of the rows of action servers, see main.goal
-- param: clients VARCHAR  Name of the rows of action clients, see main.goal
-- param: goals VARCHAR  Name of the rows of derive.goal_request
CREATE OR REPLACE MACRO derive.goal_result(servers, clients, goals) AS TABLE
WITH lossy_client AS (
    SELECT c.action_client_id
    FROM query_table(clients) AS c
    JOIN store.process AS p ON c.process_id = p.process_id
    JOIN derive.host_gap AS l ON p.host_id = l.host_id
),
goal AS (
    SELECT
        goal_id, action_client_id, action_server_id, is_accepted,
        -- Clients that were not traced have their goals at the server only.
        coalesce(action_client_id, -action_server_id) AS party,
        CASE
            WHEN action_client_id IS NULL THEN coalesce(answered_ns, taken_ns)
            -- Its answer was lost, perhaps.
            ELSE coalesce(answer_taken_ns, sent_ns, taken_ns)
        END AS at_ns
    FROM query_table(goals)
    WHERE is_accepted IS DISTINCT FROM false
        AND (
            answer_taken_ns IS NOT NULL
            OR action_client_id IS NULL
            OR action_client_id IN (FROM lossy_client)
        )
),
asked AS (
    SELECT
        q.request_id,
        coalesce(c.action_client_id, -s.action_server_id) AS party,
        CASE
            WHEN c.action_client_id IS NULL THEN q.taken_ns ELSE coalesce(q.sent_ns, q.taken_ns)
        END AS at_ns
    FROM store.request AS q
    LEFT JOIN query_table(clients) AS c ON q.client_id = c.result_client_id
    LEFT JOIN query_table(servers) AS s ON q.service_id = s.result_service_id
    WHERE c.action_client_id IS NOT NULL OR s.action_server_id IS NOT NULL
),
followed AS (
    SELECT
        r.request_id AS goal_id,
        a.request_id
    FROM derive.certain_call AS l
    JOIN asked AS a ON l.request_id = a.request_id
    JOIN store.response AS r ON l.taken_response_id = r.response_id
    JOIN goal AS g ON r.request_id = g.goal_id AND a.party = g.party
    QUALIFY count(*) OVER (PARTITION BY r.request_id) = 1
),
step AS (
    SELECT
        *,
        row_number() OVER (
            PARTITION BY party ORDER BY at_ns, change DESC, goal_id, request_id
        ) AS number
    FROM (
        SELECT
            party, at_ns, goal_id,
            NULL::BIGINT AS request_id,
            1 AS change
        FROM goal
        UNION ALL
        SELECT party, at_ns, NULL, request_id, -1
        FROM asked
    ) AS s
    WHERE NOT EXISTS (
        FROM followed AS f WHERE s.goal_id = f.goal_id OR s.request_id = f.request_id
    )
),
summed AS (
    SELECT
        *,
        sum(change) OVER (PARTITION BY party ORDER BY number) AS balance
    FROM step
),
-- A request without an open goal leaves none open: the sum begins anew.
counted AS (
    SELECT
        *,
        balance - least(0, min(balance) OVER (PARTITION BY party ORDER BY number)) AS open
    FROM summed
),
parted AS (
    SELECT
        *,
        count(*) FILTER (open = 0) OVER (
            PARTITION BY party ORDER BY number ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ) AS block
    FROM counted
),
placed AS (
    SELECT
        party, block, goal_id, request_id,
        row_number() OVER (PARTITION BY party, block, change ORDER BY number) AS place,
        count(goal_id) OVER (PARTITION BY party, block) AS goals,
        count(request_id) OVER (PARTITION BY party, block) AS requests
    FROM parted
)
SELECT goal_id, request_id, 1 AS candidate_count FROM followed
UNION ALL
SELECT
    g.goal_id, r.request_id,
    CASE WHEN coalesce(g.requests, r.requests) = 0 THEN 0 ELSE coalesce(g.goals, r.goals) END
FROM (FROM placed WHERE goal_id IS NOT NULL) AS g
FULL JOIN (FROM placed WHERE request_id IS NOT NULL) AS r
    ON g.party = r.party AND g.block = r.block AND g.place = r.place
