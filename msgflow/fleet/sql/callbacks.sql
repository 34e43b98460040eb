-- title: Callback durations and periods, of many runs
-- description: As the query callbacks says it of one run. Quantiles of several callbacks
--     are off by less than 1 %, all else is exact.
-- grain: one row per node, callback and group of runs
-- column: label_group, node, callback, runs
-- column: count BIGINT              Callback instances
-- column: open, period_min_ns, period_median_ns, period_max_ns, min_ns, median_ns, mean_ns, p95_ns,
--     p99_ns, max_ns, total_ns
-- column: symbol VARCHAR            Functions registered for it
-- column: is_internal
-- brief: node, callback, median_ns, max_ns, p95_ns, runs, count, period_median_ns, p99_ns, mean_ns
SELECT
    c.label_group, c.node, c.callback,
    count(DISTINCT c.run) AS runs,
    sum(COLUMNS(['count', 'open']))::BIGINT,
    min(c.period_min_ns) AS period_min_ns,
    CASE
        WHEN count(*) = 1 THEN any_value(c.period_median_ns)
        ELSE greatest(
            min(c.period_min_ns), least(max(c.period_max_ns), any_value(p.median_ns))
        )
    END AS period_median_ns,
    max(c.period_max_ns) AS period_max_ns,
    min(c.min_ns) AS min_ns,
    CASE
        WHEN count(*) = 1 THEN any_value(c.median_ns)
        ELSE greatest(min(c.min_ns), least(max(c.max_ns), any_value(d.median_ns)))
    END AS median_ns,
    round(sum(c.total_ns) / nullif(sum(c.count - c.open), 0))::BIGINT AS mean_ns,
    CASE
        WHEN count(*) = 1 THEN any_value(c.p95_ns)
        ELSE greatest(min(c.min_ns), least(max(c.max_ns), any_value(d.p95_ns)))
    END AS p95_ns,
    CASE
        WHEN count(*) = 1 THEN any_value(c.p99_ns)
        ELSE greatest(min(c.min_ns), least(max(c.max_ns), any_value(d.p99_ns)))
    END AS p99_ns,
    max(c.max_ns) AS max_ns,
    sum(c.total_ns)::BIGINT AS total_ns,
    string_agg(DISTINCT c.symbol, ', ' ORDER BY c.symbol) AS symbol,
    bool_and(c.is_internal) AS is_internal
FROM callbacks AS c
LEFT JOIN distributed AS d
    ON d.measure = 'callback_duration' AND c.label_group = d.label_group
    AND c.node IS NOT DISTINCT FROM d.node AND c.callback IS NOT DISTINCT FROM d.subject
LEFT JOIN distributed AS p
    ON p.measure = 'callback_period' AND c.label_group = p.label_group
    AND c.node IS NOT DISTINCT FROM p.node AND c.callback IS NOT DISTINCT FROM p.subject
GROUP BY c.label_group, c.node, c.callback
ORDER BY c.node, c.callback, c.label_group
