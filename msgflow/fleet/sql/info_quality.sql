-- title: Data quality: what is missing, and in how many runs
-- description: What msgflow info --section quality says of each run, added up over all its traces
--     and over all its processes, and over the runs. Each topic has a row.
-- grain: one row per scope, topic, measure and group of runs
-- column: label_group, scope
-- column: topic VARCHAR [topic]  Topic; empty: not of one
-- column: measure
-- column: runs BIGINT            Runs in which something is affected
-- column: affected, total, affected_percent, is_internal
-- brief: scope, topic, measure, runs, affected (even 0), total, affected_percent
SELECT
    q.label_group, q.scope,
    CASE WHEN q.scope = 'topic' THEN q.subject END AS topic,
    q.measure,
    count(DISTINCT q.run) FILTER (WHERE q.affected > 0) AS runs,
    sum(q.affected)::BIGINT AS affected,
    sum(q.total)::BIGINT AS total,
    100.0::DOUBLE * sum(q.affected) / nullif(sum(q.total), 0) AS affected_percent,
    bool_and(q.is_internal) AS is_internal
FROM info_quality AS q
GROUP BY ALL
ORDER BY q.scope, topic, q.measure, q.label_group
