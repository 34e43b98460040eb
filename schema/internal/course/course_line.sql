-- description: Values over time in which changes are looked for (main.series_window), each named;
--     moments count from the begin of the run.
-- grain: one row per series
-- reads: series_named, series_window
SELECT
    w.what, w.series_id, s.node, s.subject,
    list(w.at_ns - $origin_ns ORDER BY w.number) AS times,
    list(round(w.value, 3) ORDER BY w.number) AS value
FROM series_window AS w
LEFT JOIN series_named AS s ON w.what = s.what AND w.series_id = s.series_id
GROUP BY w.what, w.series_id, s.node, s.subject
ORDER BY w.what, w.series_id
