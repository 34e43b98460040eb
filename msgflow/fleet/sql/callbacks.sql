-- title: Callback durations and periods, of many runs
-- description: As the query callbacks says it of one run. Quantiles of several callbacks
--     are off by less than 1 %, all else is exact.
-- grain: one row per node, callback and group of runs
-- like: queries.callbacks, waits
-- column: label_group, node, callback, runs
-- column: count BIGINT              Callback instances
-- column: open, period_min_ns, period_median_ns, period_max_ns, min_ns, median_ns, mean_ns, p95_ns,
--     p99_ns, max_ns, total_ns
-- column: symbol VARCHAR            Functions registered for it
-- column: is_internal
-- brief: node, callback, median_ns, max_ns, p95_ns, runs, count, period_median_ns, p99_ns, mean_ns
WITH merged AS (
    SELECT
        c.label_group, c.node, c.callback,
        count(DISTINCT c.run) AS runs,
        sum(c.count)::BIGINT AS count,
        sum(c.open)::BIGINT AS open,
        min(c.period_min_ns) AS period_min_ns,
        CASE WHEN count(*) = 1 THEN any_value(c.period_median_ns) END AS period_median_ns,
        max(c.period_max_ns) AS period_max_ns,
        min(c.min_ns) AS min_ns,
        CASE WHEN count(*) = 1 THEN any_value(c.median_ns) END AS median_ns,
        CASE WHEN count(*) = 1 THEN any_value(c.p95_ns) END AS p95_ns,
        CASE WHEN count(*) = 1 THEN any_value(c.p99_ns) END AS p99_ns,
        max(c.max_ns) AS max_ns,
        sum(c.total_ns)::BIGINT AS total_ns,
        string_agg(DISTINCT c.symbol, ', ' ORDER BY c.symbol) AS symbol,
        bool_and(c.is_internal) AS is_internal
    FROM callbacks AS c
    GROUP BY c.label_group, c.node, c.callback
)
SELECT
    m.label_group, m.node, m.callback, m.runs, m.count, m.open, m.period_min_ns,
    coalesce(
        m.period_median_ns, greatest(m.period_min_ns, least(m.period_max_ns, p.median_ns))
    ) AS period_median_ns,
    m.period_max_ns, m.min_ns,
    coalesce(m.median_ns, greatest(m.min_ns, least(m.max_ns, d.median_ns))) AS median_ns,
    round(m.total_ns / nullif(m.count - m.open, 0))::BIGINT AS mean_ns,
    coalesce(m.p95_ns, greatest(m.min_ns, least(m.max_ns, d.p95_ns))) AS p95_ns,
    coalesce(m.p99_ns, greatest(m.min_ns, least(m.max_ns, d.p99_ns))) AS p99_ns,
    m.max_ns, m.total_ns, m.symbol, m.is_internal
FROM merged AS m
LEFT JOIN distributed AS d
    ON d.measure = 'callback_duration' AND m.label_group = d.label_group
    AND m.node IS NOT DISTINCT FROM d.node AND m.callback IS NOT DISTINCT FROM d.subject
LEFT JOIN distributed AS p
    ON p.measure = 'callback_period' AND m.label_group = p.label_group
    AND m.node IS NOT DISTINCT FROM p.node AND m.callback IS NOT DISTINCT FROM p.subject
ORDER BY m.node, m.callback, m.label_group
