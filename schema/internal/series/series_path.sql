-- name: internal.series_path
-- title: Latency of paths over time
-- description: Latency of the first arrival of each flow, by the start of the flow. Paths of one
--     name have their identity behind it.
-- grain: one row per flow with a latency
-- param: runs BIGINT[]  Runs
-- param: start_ns BIGINT  Begin of the window, epoch ns
-- param: end_ns BIGINT  End of the window, epoch ns
-- column: at_ns BIGINT [epoch ns]  Start of the flow
-- column: subject VARCHAR  Nodes and topics of the path
-- column: value_ns BIGINT [ns]  Latency
SELECT e.root_ns AS at_ns, p.path || CASE WHEN count(*) OVER (PARTITION BY p.path)
    > count(*) OVER (PARTITION BY p.path_id) THEN ' #' || p.path_id ELSE '' END AS subject,
    e.latency_ns AS value_ns
FROM main.end_to_end(
    $runs, NULL, NULL, 'callback_start', 'callback_end', $start_ns, $end_ns
) AS e
JOIN main.flow_path($runs, NULL, NULL) AS p ON e.path_id = p.path_id
WHERE e.latency_ns IS NOT NULL AND e.is_first
ORDER BY at_ns, subject, value_ns
