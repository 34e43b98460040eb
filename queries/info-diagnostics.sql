-- name: info-diagnostics
-- title: Data quality
-- description: What to know about the input before trusting a number: lost events, unknown events,
--     callbacks without an end, failed checks. The worst comes first.
-- grain: one row per finding
-- column: run_id BIGINT      Run
-- column: severity VARCHAR   error, data_loss, warning or info
-- column: name VARCHAR       What was found
-- column: count BIGINT       How often
-- column: trace VARCHAR      Path of the trace, where it concerns one
-- column: detail VARCHAR     Where, and what it means
-- brief: severity, name, count, detail, trace
SELECT
    diagnostic.run_id,
    diagnostic.severity,
    diagnostic.name,
    diagnostic.count,
    trace.path AS trace,
    diagnostic.detail
FROM main.diagnostic
LEFT JOIN main.trace ON trace.trace_id = diagnostic.trace_id
WHERE list_contains($runs, diagnostic.run_id)
ORDER BY
    diagnostic.run_id,
    list_position(['error', 'data_loss', 'warning', 'info'], diagnostic.severity),
    diagnostic.name,
    diagnostic.trace_id,
    diagnostic.detail
