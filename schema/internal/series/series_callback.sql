-- name: internal.series_callback
-- title: Duration of callbacks over time
-- description: Duration, by the start of the callback. Callbacks of one name have their identity
--     behind it.
-- grain: one row per callback instance that ended
-- param: runs BIGINT[]  Runs
-- param: start_ns BIGINT  Begin of the window, epoch ns
-- param: end_ns BIGINT  End of the window, epoch ns
-- column: at_ns BIGINT [epoch ns]  Its start
-- column: subject VARCHAR  Node and label of the callback
-- column: value_ns BIGINT [ns]  Duration
SELECT i.start_ns AS at_ns, l.node || ' ' || l.label || CASE
    WHEN min(i.callback_id) OVER (PARTITION BY l.node, l.label)
        <> max(i.callback_id) OVER (PARTITION BY l.node, l.label)
    THEN ' #' || i.callback_id ELSE '' END AS subject,
    i.end_ns - i.start_ns AS value_ns
FROM main.callback_instance AS i
JOIN main.callback_label AS l ON i.callback_id = l.callback_id
WHERE list_contains($runs, i.run_id) AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
    AND i.end_ns IS NOT NULL AND NOT l.is_internal
ORDER BY at_ns, subject, value_ns
