-- description: Of the goals of an action client to a server in the window, the one whose result
--     came latest. The request that sent it stands for it.
-- grain: one row, or none
-- param: key BIGINT[]  Action server and action client
SELECT
    latency_ns AS duration_ns,
    sent_ns AS at_ns,
    goal_id AS id,
    'request' AS kind
FROM main.goal
WHERE [action_server_id, action_client_id] = $key AND latency_ns IS NOT NULL
    AND sent_ns >= $start_ns AND sent_ns < $end_ns
ORDER BY duration_ns DESC, sent_ns, goal_id
LIMIT 1
