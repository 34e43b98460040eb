-- title: Latency from publication to take by topic and receiver, of many runs
-- description: As the query topics --measure latency says it of one run. Quantiles of several
--     subscriptions are off by less than 1 %, means by less than 1 ns, all else is exact.
-- grain: one row per topic, receiving node and group of runs
-- column: label_group, topic_name, subscriber, runs
-- column: takes BIGINT              Messages received
-- column: linked, ambiguous, negative, min_ns, median_ns, mean_ns, p95_ns, p99_ns, max_ns,
--     is_internal
-- brief: topic_name, subscriber, median_ns, p95_ns, max_ns, runs, takes, linked, negative,
--     ambiguous, mean_ns, p99_ns, min_ns
SELECT
    t.label_group, t.topic_name, t.subscriber,
    count(DISTINCT t.run) AS runs,
    sum(COLUMNS(['takes', 'linked', 'ambiguous', 'negative']))::BIGINT,
    min(t.min_ns) AS min_ns,
    CASE
        WHEN count(*) = 1 THEN any_value(t.median_ns)
        ELSE greatest(min(t.min_ns), least(max(t.max_ns), any_value(d.median_ns)))
    END AS median_ns,
    round(sum(t.mean_ns * t.linked) / nullif(sum(t.linked), 0))::BIGINT AS mean_ns,
    CASE
        WHEN count(*) = 1 THEN any_value(t.p95_ns)
        ELSE greatest(min(t.min_ns), least(max(t.max_ns), any_value(d.p95_ns)))
    END AS p95_ns,
    CASE
        WHEN count(*) = 1 THEN any_value(t.p99_ns)
        ELSE greatest(min(t.min_ns), least(max(t.max_ns), any_value(d.p99_ns)))
    END AS p99_ns,
    max(t.max_ns) AS max_ns,
    bool_and(t.is_internal) AS is_internal
FROM topics_latency AS t
LEFT JOIN distributed AS d
    ON d.measure = 'transport_latency' AND t.label_group = d.label_group
    AND t.topic_name IS NOT DISTINCT FROM d.subject AND t.subscriber IS NOT DISTINCT FROM d.node
GROUP BY t.label_group, t.topic_name, t.subscriber
ORDER BY t.topic_name, t.subscriber, t.label_group
