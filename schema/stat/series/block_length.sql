-- description: How many values that follow each other have to be resampled together, how many in a
--     row are alike, and by how much intervals have to be wider since blocks are few. `parts` is
--     the name of a table with a row per value: side, subject, how many values these have, the
--     place of the value among them, and for each statistic what it varies with, about its mean
--     where it is one.
-- grain: one row per side and subject with values enough for ten blocks
CREATE OR REPLACE MACRO derive.block_length(parts) AS TABLE
WITH part AS MATERIALIZED (
    SELECT
        side, subject, number, position,
        unnest(range(4)) AS statistic,
        unnest([median_part, mean_part, p95_part, p99_part]::DOUBLE[]) AS part
    FROM query_table(parts)
),
variance AS (
    SELECT
        side, subject, statistic,
        avg(part) AS mean,
        nullif(var_pop(part), 0) AS variance
    FROM part
    GROUP BY side, subject, statistic
),
-- Blocks of 2, 4, 8, … neighbours, each overlapping the next one by half; five of them at least.
half AS (
    SELECT
        p.side, p.subject, p.statistic, p.number,
        1 << n.level AS half_length,
        p.position >> n.level AS place,
        sum(p.part) AS sum
    FROM part AS p
    JOIN range(24) AS n (level) ON p.number >= 10 * (1 << n.level)
    WHERE p.position < (p.number >> n.level) << n.level
    GROUP BY p.side, p.subject, p.statistic, p.number, n.level, p.position >> n.level
),
whole AS (
    SELECT
        side, subject, statistic, number,
        2 * half_length AS block_length,
        sum + lead(sum) OVER (
            PARTITION BY side, subject, statistic, half_length ORDER BY place
        ) AS sum
    FROM half
),
-- For how many values they are alike (integrated autocorrelation time), by batch means: how much
-- more the means of blocks vary than those of as many independent values.
alike AS (
    SELECT
        w.side, w.subject, w.statistic, w.number, w.block_length,
        coalesce(
            avg(pow(w.sum - w.block_length * v.mean, 2) / v.variance)
            / w.block_length * w.number / (w.number - w.block_length),
            1
        ) AS times
    FROM whole AS w
    JOIN variance AS v
        ON w.side = v.side AND w.subject = v.subject AND w.statistic = v.statistic
    GROUP BY w.side, w.subject, w.statistic, w.number, w.block_length
),
grown AS (
    SELECT
        side, subject, statistic, number, block_length, times,
        lead(times) OVER (
            PARTITION BY side, subject, statistic ORDER BY block_length
        ) AS twice_times,
        max(times) OVER (PARTITION BY side, subject ORDER BY block_length) AS longest
    FROM alike
)
-- Blocks are long enough where they are twice that; the more values, the longer in any case. They
-- still miss what reaches beyond their ends: it halves with twice the length, and is added. How
-- much so few blocks vary is not known well: intervals are wider by as much as Student's t is.
SELECT
    side, subject, block_length,
    list(
        sqrt(
            least(greatest(1, 2 * twice_times / times - 1), 3)
            * (number / block_length - 1) / (number / block_length - 3)
        )
        ORDER BY statistic
    ) AS widenings,
    list(greatest(1, times, 2 * twice_times - times) ORDER BY statistic) AS times
FROM grown
WHERE block_length >= greatest(2 * longest, cbrt(number) / 2) AND number >= 10 * block_length
GROUP BY side, subject, block_length
QUALIFY row_number() OVER (PARTITION BY side, subject ORDER BY block_length) = 1
