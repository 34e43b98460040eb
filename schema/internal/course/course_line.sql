-- description: Values over time in which changes are looked for (main.series_window), each named;
--     moments count from the begin of the run.
-- grain: one row per series
-- reads: series, series_window, named_path
SELECT
    w.what, w.series_id, s.node,
    coalesce(s.subject, p.path) AS subject,
    list(w.at_ns - $origin_ns ORDER BY w.number) AS times,
    list(round(w.value, 3) ORDER BY w.number) AS value
FROM series_window AS w
LEFT JOIN series AS s
    ON w.series_id = s.object_id
    AND s.owner = CASE
        WHEN w.what IN ('duration', 'CPU time', 'timer') THEN 'callback'
        WHEN w.what = 'topic' THEN 'publisher'
        WHEN w.what IN ('wait', 'queue', 'take', 'loss') THEN 'subscription'
        WHEN w.what = 'CPU use' THEN 'program'
    END
LEFT JOIN named_path AS p ON w.what = 'latency' AND w.series_id = p.path_id
GROUP BY w.what, w.series_id, s.node, s.subject, p.path
ORDER BY w.what, w.series_id
