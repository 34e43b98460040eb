-- description: Of the instances of a callback that began in the window, the one in which other
--     threads had the CPU for longest.
-- grain: one row, or none
-- param: key
SELECT
    s.preempted_ns AS duration_ns,
    i.start_ns AS at_ns,
    i.callback_instance_id AS id,
    'callback_instance' AS kind
FROM main.callback_schedule AS s
JOIN main.callback_instance AS i ON s.callback_instance_id = i.callback_instance_id
WHERE i.callback_id = $key AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
ORDER BY s.preempted_ns DESC, i.start_ns, i.callback_instance_id
LIMIT 1
