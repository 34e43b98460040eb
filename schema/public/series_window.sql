-- description: Values over time in 128 windows of equal length: their median, or their mean where
--     few values of many count. Series with fewer than 16 windows that have values are left out.
-- grain: one row per series and window with values
-- param: series_values, settled
-- column: run_id
-- column: what VARCHAR  As in main.series_value
-- column: series_id
-- column: at_ns BIGINT [epoch ns]  Its first value
-- column: value DOUBLE  Their median in ns; the mean of a 'timer' or 'topic', and the share of a
--     'loss'
-- column: number
CREATE OR REPLACE MACRO main.series_window(series_values, settled) AS TABLE
WITH counted AS (
    SELECT
        v.what, v.series_id,
        -- A share needs ten messages to be one.
        CASE WHEN v.what = 'loss' THEN least(128, count(*) // 10) ELSE 128 END AS windows
    FROM query_table(series_values) AS v
    WHERE v.value IS NOT NULL
    GROUP BY v.what, v.series_id
),
windowed AS (
    SELECT
        v.run_id, v.what, v.series_id,
        (v.at_ns - s.start_ns) * c.windows // (s.end_ns - s.start_ns + 1) AS place,
        min(v.at_ns) AS at_ns,
        median(v.value) AS median,
        avg(v.value) AS mean
    FROM query_table(series_values) AS v
    JOIN query_table(settled) AS s ON v.run_id = s.run_id
    JOIN counted AS c ON v.what = c.what AND v.series_id = c.series_id
    WHERE v.at_ns >= s.start_ns AND v.at_ns < s.end_ns AND v.value IS NOT NULL
    GROUP BY v.run_id, v.what, v.series_id, place
)
SELECT
    run_id, what, series_id, at_ns,
    CASE WHEN what IN ('timer', 'topic', 'loss') THEN mean ELSE median END AS value,
    row_number() OVER in_time AS number
FROM windowed
WINDOW in_time AS (PARTITION BY what, series_id ORDER BY place)
QUALIFY count(*) OVER (PARTITION BY what, series_id) >= 16
