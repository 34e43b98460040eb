-- description: The instances of a callback that ran longest, as callbacks --each lists them.
-- grain: one row per callback instance
-- param: callback, limit
-- column: start_at BIGINT [ns since origin]  When it began
-- column: duration BIGINT [ns]  How long it ran
-- column: callback_instance_id BIGINT  Identity of the callback instance
SELECT
    start_ns - $origin_ns AS start_at,
    end_ns - start_ns AS duration,
    callback_instance_id
FROM main.callback_instance
WHERE run_id = $run
    AND callback_id = $callback
    AND start_ns >= $start_ns
    AND start_ns < $end_ns
    AND end_ns IS NOT NULL
ORDER BY end_ns - start_ns DESC, callback_instance_id
LIMIT $limit
