-- title: How long callbacks waited, of many runs
-- description: As the query waits says it of one run. The median of several callbacks is off
--     by less than 1 %, all else is exact.
-- grain: one row per node, callback and group of runs
-- column: label_group, node, callback, runs
-- column: count BIGINT              Callback instances
-- column: delayed_min, delayed_max, wait_median_ns, wait_max_ns, busy_worst_ns, busy_total_min_ns,
--     busy_total_max_ns, rest_total_min_ns, rest_total_max_ns, unknown, loss_affected, is_internal
-- brief: node, callback, wait_median_ns, wait_max_ns, busy_worst_ns, runs, count,
--     delayed_min, delayed_max, busy_total_min_ns, busy_total_max_ns
SELECT
    w.label_group, w.node, w.callback,
    count(DISTINCT w.run) AS runs,
    sum(COLUMNS(['count', 'delayed_min', 'delayed_max']))::BIGINT,
    CASE
        WHEN count(*) = 1 THEN any_value(w.wait_median_ns)
        ELSE least(max(w.wait_max_ns), any_value(d.median_ns))
    END AS wait_median_ns,
    max(w.wait_max_ns) AS wait_max_ns,
    max(w.busy_worst_ns) AS busy_worst_ns,
    sum(COLUMNS([
        'busy_total_min_ns', 'busy_total_max_ns', 'rest_total_min_ns', 'rest_total_max_ns',
        'unknown', 'loss_affected'
    ]))::BIGINT,
    bool_and(w.is_internal) AS is_internal
FROM waits AS w
LEFT JOIN distributed AS d
    ON d.measure = 'callback_wait' AND w.label_group = d.label_group
    AND w.node IS NOT DISTINCT FROM d.node AND w.callback IS NOT DISTINCT FROM d.subject
GROUP BY w.label_group, w.node, w.callback
ORDER BY sum(w.busy_total_max_ns) DESC, w.node, w.callback, w.label_group
