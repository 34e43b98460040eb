-- name: main.diagnostic
-- description: Things worth knowing about the input, found while reading and while linking.
-- grain: one row per finding
-- column: run_id
-- column: trace_id
-- column: name
-- column: severity
-- column: count
-- column: detail
SELECT run_id, trace_id, name, severity, count, detail
FROM store.diagnostic
UNION ALL
SELECT run_id, trace_id, name, severity, count, detail
FROM derive.link_diagnostic
