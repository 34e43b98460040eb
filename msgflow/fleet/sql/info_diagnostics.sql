-- name: fleet.info_diagnostics
-- title: Data quality: what to know before trusting a number, and of how many runs
-- description: As the query info-diagnostics says it of one run, with the run that has most of it.
-- grain: one row per kind of finding and group of runs
-- column: label_group BIGINT  Group of runs
-- column: severity VARCHAR    error, data_loss, warning or info
-- column: name VARCHAR        What was found
-- column: runs BIGINT         Runs in which it was
-- column: count BIGINT        How often, in all
-- column: worst_run VARCHAR   Run with most of it
-- column: detail VARCHAR      There: where, and what it means
-- brief: severity, name, runs, count, worst_run, detail
SELECT
    g.label_group,
    d.severity,
    d.name,
    count(DISTINCT d.run) AS runs,
    sum(d.count)::BIGINT AS count,
    arg_max(d.run, (coalesce(d.count, 0), d.run)) AS worst_run,
    arg_max(coalesce(d.detail, ''), (coalesce(d.count, 0), d.run)) AS detail
FROM info_diagnostics AS d
JOIN run_group AS g ON d.run = g.run
GROUP BY g.label_group, d.severity, d.name
ORDER BY
    list_position(['error', 'data_loss', 'warning', 'info'], d.severity), d.name, g.label_group
