-- title: Latency from publication to take by topic and receiver, of many runs
-- description: As the query topics --measure latency says it of one run. Quantiles of several
--     subscriptions are off by less than 1 %, means by less than 1 ns, all else is exact.
-- grain: one row per topic, receiving node and group of runs
-- like: e2e_latency, queries.topics-latency
-- column: label_group, topic_name, subscriber
-- column: runs BIGINT               Runs that have it
-- column: takes BIGINT              Messages received
-- column: linked
-- column: ambiguous BIGINT          Links with more than one candidate
-- column: negative, min_ns, median_ns, mean_ns, p95_ns, p99_ns, max_ns, is_internal
-- brief: topic_name, subscriber, median_ns, p95_ns, max_ns, runs, takes, linked, negative,
--     ambiguous, mean_ns, p99_ns, min_ns
WITH merged AS (
    SELECT
        t.label_group, t.topic_name, t.subscriber,
        count(DISTINCT t.run) AS runs,
        sum(COLUMNS(['takes', 'linked', 'ambiguous', 'negative']))::BIGINT,
        min(t.min_ns) AS min_ns,
        CASE WHEN count(*) = 1 THEN any_value(t.median_ns) END AS median_ns,
        round(sum(t.mean_ns * t.linked) / nullif(sum(t.linked), 0))::BIGINT AS mean_ns,
        CASE WHEN count(*) = 1 THEN any_value(t.p95_ns) END AS p95_ns,
        CASE WHEN count(*) = 1 THEN any_value(t.p99_ns) END AS p99_ns,
        max(t.max_ns) AS max_ns,
        bool_and(t.is_internal) AS is_internal
    FROM topics_latency AS t
    GROUP BY t.label_group, t.topic_name, t.subscriber
)
SELECT
    m.label_group, m.topic_name, m.subscriber, m.runs, m.takes, m.linked, m.ambiguous, m.negative,
    m.min_ns,
    coalesce(m.median_ns, greatest(m.min_ns, least(m.max_ns, d.median_ns))) AS median_ns,
    m.mean_ns,
    coalesce(m.p95_ns, greatest(m.min_ns, least(m.max_ns, d.p95_ns))) AS p95_ns,
    coalesce(m.p99_ns, greatest(m.min_ns, least(m.max_ns, d.p99_ns))) AS p99_ns,
    m.max_ns, m.is_internal
FROM merged AS m
LEFT JOIN distributed AS d
    ON d.measure = 'transport_latency' AND m.label_group = d.label_group
    AND m.topic_name IS NOT DISTINCT FROM d.subject AND m.subscriber IS NOT DISTINCT FROM d.node
ORDER BY m.topic_name, m.subscriber, m.label_group
