-- name: main.diagnostic
-- description: Things worth knowing about the input, found while reading and while linking.
-- grain: one row per finding
-- column: run_id BIGINT  Run that the row belongs to
-- column: trace_id BIGINT  Trace it was recorded in; NULL: not one trace alone
-- column: name VARCHAR  What was found
-- column: severity VARCHAR  'info', 'warning', 'data_loss' or 'error'
-- column: count BIGINT  How often
-- column: detail VARCHAR  Where, and what it means
-- needs: store.diagnostic, derive.link_diagnostic, derive.annotation_conflict
SELECT run_id, trace_id, name, severity, count, detail
FROM store.diagnostic
UNION ALL
SELECT run_id, trace_id, name, severity, count, detail
FROM derive.link_diagnostic
UNION ALL
SELECT run_id, trace_id, name, severity, count, detail
FROM derive.annotation_conflict
