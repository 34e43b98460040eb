-- title: Data quality
-- description: What to know before trusting a number: lost events, unknown events, callbacks
--     without an end, clocks that are apart. The worst comes first; the view finding has the cause
--     and cure of each.
-- grain: one row per place at which something was found
-- column: run_id
-- column: severity VARCHAR   error, warning or info
-- column: name VARCHAR       What was found
-- column: count BIGINT       How often
-- column: subject VARCHAR    Where: a trace, process, host, topic
-- column: detail VARCHAR     Numbers, and what they mean
-- column: phase VARCHAR      What it is about: input or recording
-- brief: severity, name, count, detail, subject
SELECT run_id, severity, name, count, subject, detail, phase
FROM main.finding
WHERE list_contains($runs, run_id)
ORDER BY
    run_id,
    list_position(['error', 'warning', 'info'], severity),
    name, trace_id, subject, detail
