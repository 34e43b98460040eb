-- description: Ends of the confidence interval of side b less side a, as deviations from the
--     difference that was measured, by a circular block bootstrap. `measures` is the name of a
--     table with number, quantiles, mean and values in order of each side and subject, `blocks_of`
--     that of one with their block_length and widenings.
-- grain: one row per subject and statistic
CREATE OR REPLACE MACRO derive.bootstrap_interval(
    measures, blocks_of, resamples, confidence, seed
) AS TABLE
-- Blocks wrap around the end. More than 1000 values (ten blocks) are not drawn at once: the spread
-- of fewer is wider by the root of how many times fewer they are, and is made narrower by that. Of
-- a block longer than 128 values, every other one (third, …) is taken.
WITH ring AS (
    SELECT
        m.side, m.subject, m.number, m.quantiles, m.mean_ns, k.block_length,
        greatest(10, ceil(least(m.number, 1000) / k.block_length))::BIGINT AS blocks,
        ceil(k.block_length / 128)::BIGINT AS step,
        list_concat(m.series, m.series[:k.block_length - 1]) AS series,
        k.widenings,
        hash(m.side, m.subject, seed) AS salt
    FROM query_table(measures) AS m
    JOIN query_table(blocks_of) AS k ON m.side = k.side AND m.subject = k.subject
    WHERE resamples * (1 - confidence) >= 20 - 1e-9
),
drawn AS (
    SELECT
        r.side, r.subject, r.quantiles, r.mean_ns, r.widenings,
        sqrt(r.blocks * r.block_length / r.number) AS narrowing,
        n.resample,
        list_sort(flatten(list_transform(
            list_transform(
                range(r.blocks),
                lambda block: (hash(r.salt, n.resample, block) % r.number)::BIGINT
            ),
            lambda before: r.series[1 + before:r.block_length + before:r.step]
        ))) AS sorted
    FROM ring AS r
    CROSS JOIN range(resamples) AS n (resample)
),
resampled AS (
    SELECT
        side, subject, resample, narrowing, widenings,
        [
            sorted[ceil(0.5 * len(sorted))::BIGINT] - quantiles[1],
            list_avg(sorted) - mean_ns,
            sorted[ceil(0.95 * len(sorted))::BIGINT] - quantiles[2],
            sorted[ceil(0.99 * len(sorted))::BIGINT] - quantiles[3]
        ]::DOUBLE[] AS deviations
    FROM drawn
),
deviation AS (
    SELECT
        side, subject, resample,
        unnest(['median', 'mean', 'p95', 'p99']) AS statistic,
        unnest(list_transform(
            list_zip(deviations, widenings), lambda each: each[1] * each[2] * narrowing
        )) AS deviation_ns
    FROM resampled
)
SELECT
    a.subject, a.statistic,
    quantile_cont(
        b.deviation_ns - a.deviation_ns, [(1 - confidence) / 2, (1 + confidence) / 2]
    ) AS ends
FROM deviation AS a
JOIN deviation AS b
    ON a.subject = b.subject AND a.statistic = b.statistic AND a.resample = b.resample
WHERE a.side = 'a' AND b.side = 'b'
GROUP BY a.subject, a.statistic
