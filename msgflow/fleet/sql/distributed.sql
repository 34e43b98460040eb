-- title: Quantiles of times that were counted in buckets
-- description: Counts of all runs of a group are added, then the bucket is looked up that holds the
--     quantile. What stands for a bucket is off by less than 1 % of any time in it.
-- grain: one row per group of runs, measure, node and subject
-- kind: inline
WITH summed AS (
    SELECT
        label_group, measure, node, subject, bucket,
        sum(count) AS number
    FROM distribution
    GROUP BY label_group, measure, node, subject, bucket
),
ranked AS (
    SELECT
        label_group, measure, node, subject,
        round(sign(bucket) * 2 / 2.02 * pow(1.02::DOUBLE, abs(bucket) - 1))::BIGINT AS time_ns,
        sum(number) OVER (PARTITION BY label_group, measure, node, subject ORDER BY bucket) AS upto,
        sum(number) OVER (PARTITION BY label_group, measure, node, subject) AS total
    FROM summed
)
SELECT
    label_group, measure, node, subject,
    min(time_ns) FILTER (WHERE upto >= ceil(0.5 * total)) AS median_ns,
    min(time_ns) FILTER (WHERE upto >= ceil(0.95 * total)) AS p95_ns,
    min(time_ns) FILTER (WHERE upto >= ceil(0.99 * total)) AS p99_ns
FROM ranked
GROUP BY label_group, measure, node, subject
