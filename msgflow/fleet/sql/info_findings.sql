-- title: What is worth knowing about recordings before trusting a number, and how many have it
-- description: Findings of the query info --section findings over many runs, with cause and cure.
--     Each names the run that has most of it.
-- grain: one row per kind of finding and group of runs
-- column: label_group
-- column: severity VARCHAR    'error' where results are wrong or missing, 'warning' where they may
--     be, or 'info'
-- column: name VARCHAR        Name of the finding
-- column: title
-- column: runs BIGINT         Runs in which it was
-- column: places BIGINT       Traces, processes, topics where it was
-- column: count BIGINT        How often, in all
-- column: worst_run VARCHAR   Run with most of it
-- column: subject VARCHAR     There: where
-- column: detail VARCHAR      There: numbers, and what they mean
-- column: cause, cure
-- brief: severity, title, runs, count, worst_run, subject, places, cure
SELECT
    f.label_group, f.severity, f.name,
    any_value(f.title) AS title,
    count(DISTINCT f.run) AS runs,
    count(*) AS places,
    sum(f.count)::BIGINT AS count,
    arg_max(f.run, (coalesce(f.count, 0), f.run, f.subject)) AS worst_run,
    arg_max(f.subject, (coalesce(f.count, 0), f.run, f.subject)) AS subject,
    arg_max(coalesce(f.detail, ''), (coalesce(f.count, 0), f.run, f.subject)) AS detail,
    any_value(f.cause) AS cause,
    any_value(f.cure) AS cure
FROM finding AS f
GROUP BY f.label_group, f.severity, f.name
ORDER BY
    list_position(['error', 'warning', 'info'], f.severity), runs DESC, f.name, f.label_group
