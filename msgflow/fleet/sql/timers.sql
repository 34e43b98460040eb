-- title: Whether timers keep their period, of many runs
-- description: As the query timers says it of one run. Quantiles of runs cannot be added up: the
--     largest of any timer stands for them.
-- grain: one row per node, timer and group of runs
-- column: label_group, node, callback, runs
-- column: count BIGINT              Calls
-- column: missed, bunched
-- column: jitter_median_most_ns BIGINT [ns]  Largest median of the jitter
-- column: jitter_p99_most_ns BIGINT [ns]  Largest 99 % quantile of the jitter
-- column: jitter_max_ns
-- column: lateness_median_most_ns BIGINT [ns]  Largest median of the lateness
-- column: lateness_p99_most_ns BIGINT [ns]  Largest 99 % quantile of the lateness
-- column: lateness_max_ns
-- column: unknown BIGINT            Of count, those whose due moment is not known
-- column: loss_affected, is_internal
-- brief: node, callback, count, missed, lateness_p99_most_ns, lateness_max_ns, jitter_p99_most_ns,
--     runs, lateness_median_most_ns, bunched
SELECT
    t.label_group, t.node, t.callback,
    count(DISTINCT t.run) AS runs,
    sum(COLUMNS(['count', 'missed', 'bunched']))::BIGINT,
    max(t.jitter_median_ns) AS jitter_median_most_ns,
    max(t.jitter_p99_ns) AS jitter_p99_most_ns,
    max(t.jitter_max_ns) AS jitter_max_ns,
    max(t.lateness_median_ns) AS lateness_median_most_ns,
    max(t.lateness_p99_ns) AS lateness_p99_most_ns,
    max(t.lateness_max_ns) AS lateness_max_ns,
    sum(t.unknown)::BIGINT AS unknown,
    sum(t.loss_affected)::BIGINT AS loss_affected,
    bool_and(t.is_internal) AS is_internal
FROM timers AS t
GROUP BY t.label_group, t.node, t.callback
ORDER BY t.node, t.callback, t.label_group
