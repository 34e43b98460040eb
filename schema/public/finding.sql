-- description: Things worth knowing about the input or the recording before trusting a number: lost
--     events, objects not seen to be created, clocks apart.
-- grain: one row per place at which something was found
-- column: run_id, trace_id, name
-- column: phase VARCHAR  What it is about: 'input' or 'recording'
-- column: severity VARCHAR  'error' where results are wrong or missing, 'warning' where they may
--     be, or 'info'
-- column: subject VARCHAR  Where: a trace, process, host, topic
-- column: count, detail, cause, cure, title
-- column: description VARCHAR  What it means for results
SELECT
    f.run_id, f.trace_id, f.name, k.phase, k.severity,
    coalesce(f.subject, t.path, 'the ' || k.phase) AS subject,
    f.count, f.detail, k.cause, k.cure, k.title, k.description
FROM store.finding AS f
JOIN derive.finding_kind AS k ON f.name = k.name
LEFT JOIN store.trace AS t ON f.trace_id = t.trace_id
