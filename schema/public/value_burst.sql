-- description: Timers and topics that are called or published far faster than usual for a moment:
--     in less than a fifth of the median period each, and five times more than are due, so that
--     not what catches up after a pause.
-- grain: one row per series
-- param: series_values
-- column: run_id
-- column: what VARCHAR  'timer', 'topic' or 'take'
-- column: series_id
-- column: at_ns BIGINT [epoch ns]  Begin of the first one
-- column: usual DOUBLE  Median time from one to the next, in ns
-- column: shortest_ns BIGINT [ns]  Mean time from one to the next in the fastest one
-- column: count BIGINT  How many are more than usual, in all of them
CREATE OR REPLACE MACRO main.value_burst(series_values) AS TABLE
WITH middle AS (
    SELECT
        what, series_id,
        median(value) AS median_ns
    FROM query_table(series_values)
    WHERE what IN ('timer', 'topic', 'take')
    GROUP BY what, series_id
    HAVING count(value) >= 40
),
usual AS (
    SELECT m.what, m.series_id, m.median_ns
    FROM middle AS m
    JOIN query_table(series_values) AS v ON m.what = v.what AND m.series_id = v.series_id
    WHERE v.value < m.median_ns / 5
    GROUP BY m.what, m.series_id, m.median_ns
    HAVING count(*) >= 5
),
-- What is not fast, and what is fast behind it.
numbered AS (
    SELECT
        v.run_id, v.what, v.series_id, v.at_ns, v.value, u.median_ns,
        v.value < u.median_ns / 5 AS is_fast,
        count(*) FILTER (v.value >= u.median_ns / 5) OVER in_time AS number,
        sum(1 - v.value / u.median_ns) OVER in_time AS ahead
    FROM query_table(series_values) AS v
    JOIN usual AS u ON v.what = u.what AND v.series_id = u.series_id
    WHERE v.value IS NOT NULL
    WINDOW in_time AS (PARTITION BY v.what, v.series_id ORDER BY v.at_ns ROWS UNBOUNDED PRECEDING)
),
-- Ahead of what is due, compared with the last 60 before the burst.
gained AS (
    SELECT
        *,
        ahead - max(ahead) OVER (
            PARTITION BY what, series_id
            ORDER BY at_ns
            ROWS BETWEEN 60 PRECEDING AND 7 PRECEDING
        ) AS gain
    FROM numbered
),
burst AS (
    SELECT
        run_id, what, series_id, median_ns,
        min(at_ns) AS at_ns,
        avg(value) FILTER (is_fast) AS fast_ns,
        count(*) - sum(value) / median_ns AS more
    FROM gained
    GROUP BY run_id, what, series_id, median_ns, number
    HAVING more >= 5 AND max(gain) >= 5
)
SELECT
    run_id, what, series_id,
    min(at_ns) AS at_ns,
    any_value(median_ns) AS usual,
    min(fast_ns)::BIGINT AS shortest_ns,
    round(sum(more))::BIGINT AS count
FROM burst
GROUP BY run_id, what, series_id
