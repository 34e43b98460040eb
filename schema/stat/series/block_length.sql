-- description: How many values that follow each other have to be resampled together, how many in a
--     row are alike, and by how much intervals have to be wider since blocks are few. `parts` is
--     the name of a table with a row per value: side, subject, how many values these have, the
--     place of the value among them, and for each statistic what it varies with, about its mean
--     where it is one.
-- grain: one row per side and subject with values enough for ten blocks
CREATE OR REPLACE MACRO derive.block_length(parts) AS TABLE
WITH variance AS (
    SELECT
        side, subject,
        avg(median_part) AS median_mean,
        avg(mean_part) AS mean_mean,
        avg(p95_part) AS p95_mean,
        avg(p99_part) AS p99_mean,
        nullif(var_pop(median_part), 0) AS median_variance,
        nullif(var_pop(mean_part), 0) AS mean_variance,
        nullif(var_pop(p95_part), 0) AS p95_variance,
        nullif(var_pop(p99_part), 0) AS p99_variance
    FROM query_table(parts)
    GROUP BY side, subject
),
-- Blocks of 2, 4, 8, … neighbours, each overlapping the next one by half; five of them at least.
half AS (
    SELECT
        c.side, c.subject,
        1 << n.level AS half_length,
        c.position >> n.level AS place,
        any_value(c.number) AS number,
        sum(c.median_part) AS median_sum,
        sum(c.mean_part) AS mean_sum,
        sum(c.p95_part) AS p95_sum,
        sum(c.p99_part) AS p99_sum
    FROM query_table(parts) AS c
    JOIN range(24) AS n (level) ON c.number >= 10 * (1 << n.level)
    WHERE c.position < (c.number >> n.level) << n.level
    GROUP BY c.side, c.subject, n.level, c.position >> n.level
),
whole AS (
    SELECT
        side, subject, number,
        2 * half_length AS block_length,
        median_sum + lead(median_sum) OVER following AS median_sum,
        mean_sum + lead(mean_sum) OVER following AS mean_sum,
        p95_sum + lead(p95_sum) OVER following AS p95_sum,
        p99_sum + lead(p99_sum) OVER following AS p99_sum
    FROM half
    WINDOW following AS (PARTITION BY side, subject, half_length ORDER BY place)
),
-- For how many values they are alike (integrated autocorrelation time), by batch means: how much
-- more the means of blocks vary than those of as many independent values.
alike AS (
    SELECT
        w.side, w.subject, w.number, w.block_length,
        list_transform(
            [
                avg(pow(w.median_sum - w.block_length * v.median_mean, 2) / v.median_variance),
                avg(pow(w.mean_sum - w.block_length * v.mean_mean, 2) / v.mean_variance),
                avg(pow(w.p95_sum - w.block_length * v.p95_mean, 2) / v.p95_variance),
                avg(pow(w.p99_sum - w.block_length * v.p99_mean, 2) / v.p99_variance)
            ],
            lambda each: coalesce(each / w.block_length * w.number / (w.number - w.block_length), 1)
        ) AS times
    FROM whole AS w
    JOIN variance AS v ON w.side = v.side AND w.subject = v.subject
    GROUP BY w.side, w.subject, w.number, w.block_length
),
grown AS (
    SELECT
        side, subject, number, block_length, times,
        lead(times) OVER longer AS twice_times,
        max(list_max(times)) OVER longer AS longest
    FROM alike
    WINDOW longer AS (PARTITION BY side, subject ORDER BY block_length)
)
-- Blocks are long enough where they are twice that; the more values, the longer in any case. They
-- still miss what reaches beyond their ends: it halves with twice the length, and is added. How
-- much so few blocks vary is not known well: intervals are wider by as much as Student's t is.
SELECT
    side, subject, block_length,
    list_transform(
        list_zip(times, twice_times),
        lambda each: sqrt(
            least(greatest(1, 2 * each[2] / each[1] - 1), 3)
            * (number / block_length - 1) / (number / block_length - 3)
        )
    ) AS widenings,
    list_transform(
        list_zip(times, twice_times),
        lambda each: greatest(1, each[1], 2 * each[2] - each[1])
    ) AS times
FROM grown
WHERE block_length >= greatest(2 * longest, cbrt(number) / 2) AND number >= 10 * block_length
QUALIFY row_number() OVER (PARTITION BY side, subject ORDER BY block_length) = 1
