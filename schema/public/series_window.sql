-- description: Values over time in 128 windows of equal length: their median, of periods and CPU
--     use their mean. Series with fewer than 16 windows that have values are left out, and so are
--     losses (main.loss_step).
-- grain: one row per series and window with values
-- param: series_values, settled
-- column: run_id
-- column: what VARCHAR  As in main.series_value
-- column: series_id
-- column: at_ns BIGINT [epoch ns]  Its first value
-- column: value DOUBLE  Their median; the mean of a 'timer', 'topic', 'take' or 'CPU use'
-- column: number
CREATE OR REPLACE MACRO main.series_window(series_values, settled) AS TABLE
WITH windowed AS (
    SELECT
        v.run_id, v.what, v.series_id,
        (v.at_ns - s.start_ns) * 128 // (s.end_ns - s.start_ns + 1) AS place,
        min(v.at_ns) AS at_ns,
        median(v.value) AS median,
        avg(v.value) AS mean
    FROM query_table(series_values) AS v
    JOIN query_table(settled) AS s ON v.run_id = s.run_id
    WHERE v.value IS NOT NULL AND v.what <> 'loss'
    GROUP BY v.run_id, v.what, v.series_id, place
)
SELECT
    run_id, what, series_id, at_ns,
    CASE WHEN what IN ('timer', 'topic', 'take', 'CPU use') THEN mean ELSE median END AS value,
    row_number() OVER in_time AS number
FROM windowed
WINDOW in_time AS (PARTITION BY what, series_id ORDER BY place)
QUALIFY count(*) OVER (PARTITION BY what, series_id) >= 16
