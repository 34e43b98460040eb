-- description: When an action server was concerned with one goal and no other: then what it
--     publishes is of that goal. Goals whose results cannot be told apart have no such times.
-- grain: one row per server and moment at which that changes
-- column: goal_id BIGINT  The only goal from then on; NULL: none, several, or not known which
-- param: spans VARCHAR  Name of the rows of derive.goal_span
CREATE OR REPLACE MACRO derive.goal_alone(spans) AS TABLE
WITH change AS (
    SELECT
        action_server_id,
        start_ns AS at_ns,
        goal_id, 1 AS change
    FROM query_table(spans)
    UNION ALL
    SELECT action_server_id, end_ns, goal_id, -1
    FROM query_table(spans)
),
-- Of one open goal, the sum is its identity.
summed AS (
    SELECT
        action_server_id, at_ns,
        sum(change) AS change,
        sum(change * goal_id) AS goal_change
    FROM change
    GROUP BY action_server_id, at_ns
),
open AS (
    SELECT
        action_server_id, at_ns,
        sum(change) OVER later AS open,
        sum(goal_change) OVER later AS goal_id
    FROM summed
    WINDOW later AS (PARTITION BY action_server_id ORDER BY at_ns)
)
SELECT o.action_server_id, o.at_ns, s.goal_id
FROM open AS o
LEFT JOIN query_table(spans) AS s ON o.open = 1 AND o.goal_id = s.goal_id AND s.is_end_certain
