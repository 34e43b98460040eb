-- title: Quantiles of times that were counted in buckets
-- description: Counts of all runs of a group are added, then the bucket is looked up that holds the
--     quantile. What stands for a bucket is off by less than 1 % of any time in it.
-- grain: one row per group of runs, measure, node and subject
-- kind: inline
WITH summed AS (
    SELECT g.label_group, d.measure, d.node, d.subject, d.bucket, sum(d.count) AS number
    FROM distribution AS d
    JOIN run_group AS g ON d.run = g.run
    GROUP BY g.label_group, d.measure, d.node, d.subject, d.bucket
),
ranked AS (
    SELECT
        label_group, measure, node, subject, bucket,
        sum(number) OVER (PARTITION BY label_group, measure, node, subject ORDER BY bucket) AS upto,
        sum(number) OVER (PARTITION BY label_group, measure, node, subject) AS total
    FROM summed
),
quantile AS (
    SELECT
        label_group, measure, node, subject,
        min(bucket) FILTER (WHERE upto >= ceil(0.5 * total)) AS median,
        min(bucket) FILTER (WHERE upto >= ceil(0.95 * total)) AS p95,
        min(bucket) FILTER (WHERE upto >= ceil(0.99 * total)) AS p99
    FROM ranked
    GROUP BY label_group, measure, node, subject
)
SELECT
    label_group, measure, node, subject,
    round(sign(median) * 2 / 2.02 * pow(1.02::DOUBLE, abs(median) - 1))::BIGINT AS median_ns,
    round(sign(p95) * 2 / 2.02 * pow(1.02::DOUBLE, abs(p95) - 1))::BIGINT AS p95_ns,
    round(sign(p99) * 2 / 2.02 * pow(1.02::DOUBLE, abs(p99) - 1))::BIGINT AS p99_ns
FROM quantile
