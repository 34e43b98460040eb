-- description: What executor threads did (main.executor_activity) by pieces of time. Of threads
--     whose executor tells nothing of itself, takes and callbacks alone are known.
-- grain: one row per thread, piece of time and activity
-- param: bins BIGINT {1..2000} = 200  Number of pieces
-- column: thread_id, start_at, length
-- column: activity VARCHAR  'wait', 'select', 'callback' (or a take, or a service) or 'blocked'
-- column: busy BIGINT [ns]  Time of the piece with it
WITH did AS (
    SELECT
        thread_id, start_ns, end_ns,
        CASE WHEN activity IN ('take', 'service') THEN 'callback' ELSE activity END AS activity
    FROM main.executor_activity_within([$run], $start_ns, $end_ns)
    WHERE end_ns IS NOT NULL
),
clipped AS (
    SELECT
        d.thread_id, d.activity, e.width,
        greatest(d.start_ns, $start_ns) - $start_ns AS begin_at,
        least(d.end_ns, $end_ns) - $start_ns AS end_at
    FROM did AS d
    CROSS JOIN extent AS e
),
cut AS (
    SELECT
        *,
        unnest(range(begin_at // width, (end_at - 1) // width + 1)) AS bin
    FROM clipped
)
SELECT
    thread_id,
    $start_ns - $origin_ns + bin * width AS start_at,
    width AS length,
    activity,
    sum(least(end_at, (bin + 1) * width) - greatest(begin_at, bin * width))::BIGINT AS busy
FROM cut
GROUP BY thread_id, bin, width, activity
ORDER BY thread_id, start_at, activity
