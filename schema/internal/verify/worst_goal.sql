-- title: The goal that took longest
-- description: Of the goals of an action client to a server in the window, the one whose result
--     came latest. The request that sent it stands for it.
-- grain: one row, or none
-- param: key BIGINT[]  Action server and action client
-- column: duration_ns BIGINT [ns]  How long it took
-- column: at_ns BIGINT [epoch ns]  When it began
-- column: id BIGINT  Its identity
-- column: kind VARCHAR  What it is: 'request'
SELECT latency_ns AS duration_ns, sent_ns AS at_ns, goal_id AS id, 'request' AS kind
FROM main.goal
WHERE [action_server_id, action_client_id] = $key AND latency_ns IS NOT NULL
    AND sent_ns >= $start_ns AND sent_ns < $end_ns
ORDER BY duration_ns DESC, sent_ns, goal_id
LIMIT 1
