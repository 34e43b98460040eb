-- name: main.diagnostic
-- description: Things worth knowing about the input.
-- grain: one row per finding
-- column: run_id BIGINT       Run that the row belongs to
-- column: trace_id BIGINT     Trace it was recorded in
-- column: name VARCHAR        What was found
-- column: severity VARCHAR    'info', 'warning', 'data_loss' or 'error'
-- column: count BIGINT        How often
-- column: detail VARCHAR      Where, and what it means
-- needs: store.diagnostic
SELECT run_id, trace_id, name, severity, count, detail
FROM store.diagnostic
