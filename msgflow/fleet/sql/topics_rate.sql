-- title: Publication rates and periods, of many runs
-- description: As the query topics --measure rate says it of one run. The rate is that of all runs
--     together, without the time between them. Medians and deviations of runs cannot be added up:
--     the smallest and the largest median of any publisher stand for them.
-- grain: one row per topic, publishing node and group of runs
-- column: label_group, topic_name, publisher, runs
-- column: count BIGINT              Publications
-- column: rate_hz, period_min_ns
-- column: period_median_least_ns BIGINT [ns]  Smallest median of these times
-- column: period_median_most_ns BIGINT [ns]  Largest median of these times
-- column: period_max_ns, is_internal
-- brief: topic_name, publisher, rate_hz, period_median_least_ns, period_median_most_ns,
--     period_max_ns, runs, count, period_min_ns
SELECT
    p.label_group, p.topic_name, p.publisher,
    count(DISTINCT p.run) AS runs,
    sum(p.count)::BIGINT AS count,
    CASE
        WHEN count(*) = 1 THEN any_value(p.rate_hz)
        ELSE sum(p.count - 1) FILTER (WHERE p.rate_hz > 0)
            / sum((p.count - 1) / p.rate_hz) FILTER (WHERE p.rate_hz > 0)
    END AS rate_hz,
    min(p.period_min_ns) AS period_min_ns,
    min(p.period_median_ns) AS period_median_least_ns,
    max(p.period_median_ns) AS period_median_most_ns,
    max(p.period_max_ns) AS period_max_ns,
    bool_and(p.is_internal) AS is_internal
FROM topics_rate AS p
GROUP BY p.label_group, p.topic_name, p.publisher
ORDER BY p.topic_name, p.publisher, p.label_group
