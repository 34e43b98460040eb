-- description: What happened at a moment (main.occasion), for all axes of time. What lies in one
--     piece of time is one mark.
-- grain: one row per kind, and piece of time in which it happened
-- param: bins BIGINT {1..2000} = 400  Number of pieces
-- column: start_at BIGINT [ns since origin]  When the first of it happened
-- column: kind VARCHAR  As in main.occasion
-- column: count BIGINT  How much happened
-- column: sentences VARCHAR[]  The first five of it
WITH series AS MATERIALIZED (FROM main.series([$run]))
SELECT
    min(o.at_ns) - $origin_ns AS start_at,
    o.kind,
    count(*) AS count,
    list(o.sentence ORDER BY o.at_ns, o.sentence)[:5] AS sentences
FROM main.occasion([$run], 'series') AS o
CROSS JOIN extent AS e
WHERE o.at_ns >= $start_ns AND o.at_ns < $end_ns
GROUP BY o.kind, (o.at_ns - $start_ns) // e.width
ORDER BY start_at, o.kind
