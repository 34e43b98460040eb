-- description: Instances of a callback by pieces of time, with the longest of each.
-- grain: one row per piece of time in which an instance began
-- param: callback, bins
-- column: start_at, length
-- column: count BIGINT  Instances that began in it
-- column: median BIGINT [ns]  Median duration; NULL: none was seen to end
-- column: duration BIGINT [ns]  Longest duration
-- column: callback_instance_id BIGINT  Instance with the longest duration; the first one if none was
--     seen to end
SELECT
    $start_ns - $origin_ns + (i.start_ns - $start_ns) // e.width * e.width AS start_at,
    e.width AS length,
    count(*) AS count,
    quantile_disc(i.end_ns - i.start_ns, 0.5) AS median,
    max(i.end_ns - i.start_ns) AS duration,
    arg_max(
        i.callback_instance_id, (coalesce(i.end_ns - i.start_ns, -1), -i.callback_instance_id)
    ) AS callback_instance_id
FROM main.callback_instance AS i
CROSS JOIN extent AS e
WHERE i.run_id = $run
    AND i.callback_id = $callback
    AND i.start_ns >= $start_ns
    AND i.start_ns < $end_ns
GROUP BY ALL
ORDER BY start_at
