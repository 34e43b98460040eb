-- description: Of the instances of a callback that ended, the longest that began in the window.
-- grain: one row, or none
-- param: key
SELECT
    end_ns - start_ns AS duration_ns,
    start_ns AS at_ns,
    callback_instance_id AS id,
    'callback_instance' AS kind
FROM main.callback_instance
WHERE callback_id = $key AND end_ns IS NOT NULL AND start_ns >= $start_ns AND start_ns < $end_ns
ORDER BY duration_ns DESC, start_ns, callback_instance_id
LIMIT 1
