-- description: Of the calls of a timer in the window, the one that came latest after it was due.
-- grain: one row, or none
-- param: key BIGINT  Its callback
SELECT
    wait_ns AS duration_ns,
    start_ns AS at_ns,
    callback_instance_id AS id,
    'callback_instance' AS kind
FROM main.executor_wait
WHERE callback_id = $key AND since = 'timer' AND NOT is_loss_affected
    AND start_ns >= $start_ns AND start_ns < $end_ns
ORDER BY duration_ns DESC, start_ns, callback_instance_id
LIMIT 1
