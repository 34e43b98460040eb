-- description: Moments at which values change from one level to another. The windows before each
--     moment are compared with those behind it, 8, 16 and 24 on each side (of CPU use, which is
--     sampled once a second, 4 as well): nine of ten of one side exceed nine of ten of the other,
--     the medians differ by far more than the windows of one side do among themselves, and by far
--     more than at most other moments of the series. So neither what varies all the time is a
--     change, nor what grows all the time.
-- grain: one row per change
-- param: windows
-- column: run_id
-- column: what VARCHAR  As in main.series_value
-- column: series_id
-- column: at_ns BIGINT [epoch ns]  The first value of the first window behind it
-- column: before, after
-- column: score
-- column: number
CREATE OR REPLACE MACRO main.value_step(windows) AS TABLE
WITH beside AS (
    SELECT
        w.run_id, w.what, w.series_id, w.at_ns, w.number, h.width,
        list(w.value) OVER (around ROWS BETWEEN h.width PRECEDING AND 1 PRECEDING) AS before,
        list(w.value) OVER (around ROWS BETWEEN CURRENT ROW AND h.width - 1 FOLLOWING) AS after
    FROM query_table(windows) AS w
    JOIN (VALUES (4), (8), (16), (24)) AS h (width) ON h.width > 4 OR w.what = 'CPU use'
    WINDOW around AS (PARTITION BY w.what, w.series_id, h.width ORDER BY w.number)
),
compared AS (
    SELECT
        run_id, what, series_id, at_ns, number, width,
        list_median(before) AS before,
        list_median(after) AS after,
        list_aggregate(before, 'quantile_cont', [0.1, 0.9]) AS ends_before,
        list_aggregate(after, 'quantile_cont', [0.1, 0.9]) AS ends_after,
        sqrt(1 / len(before) + 1 / len(after)) AS scale
    FROM beside
    WHERE len(before) >= least(8, width) AND len(after) >= least(8, width)
),
-- Standard deviations, of normal values: from one window to the next, and of one side.
noise AS (
    SELECT
        what, series_id,
        median(abs(step)) AS deviation
    FROM (
        SELECT
            what, series_id,
            value - lag(value) OVER (PARTITION BY what, series_id ORDER BY number) AS step
        FROM query_table(windows)
    )
    GROUP BY what, series_id
),
judged AS (
    SELECT
        c.*,
        abs(c.after - c.before) AS size,
        ends_after[1] > ends_before[2] OR ends_after[2] < ends_before[1] AS is_apart,
        greatest(
            n.deviation,
            (ends_before[2] - ends_before[1] + ends_after[2] - ends_after[1]) / 5,
            1e-9
        ) * c.scale AS deviation,
        greatest(
            median(abs(c.after - c.before)) OVER (PARTITION BY c.what, c.series_id, c.width), 1e-9
        ) AS usual
    FROM compared AS c
    JOIN noise AS n ON c.what = n.what AND c.series_id = n.series_id
)
SELECT
    run_id, what, series_id, at_ns, before, after,
    size / deviation AS score,
    number
FROM judged
WHERE is_apart
    AND size > 8 * deviation
    -- A minute has 60 samples of CPU use: too few to know what is usual.
    AND (size > 4 * usual OR what = 'CPU use')
    AND size > main.least_change(what)
    AND greatest(before, after) >= 1.1 * least(before, after)
WINDOW
    near AS (
        PARTITION BY what, series_id
        ORDER BY number
        RANGE BETWEEN 12 PRECEDING AND 12 FOLLOWING
    ),
    alike AS (PARTITION BY what, series_id, before, after, width, size / deviation)
-- The clearest moment of those around, of equal ones the one in the middle.
QUALIFY size / deviation >= max(size / deviation) OVER near
    AND row_number() OVER (alike ORDER BY number) = (1 + count(*) OVER alike) // 2
