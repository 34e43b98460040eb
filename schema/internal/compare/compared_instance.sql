-- kind: inline
-- description: The callback instances of two runs, or of two windows of time, that are compared.
-- grain: one row per side, 'a' or 'b', and callback instance in it
-- param: run_a, run_b, skip_first, a_window, b_window
SELECT w.side, l.node, l.label, i.callback_instance_id, i.start_ns, i.end_ns
FROM main.callback_instance AS i
JOIN main.callback_label AS l ON i.callback_id = l.callback_id
JOIN main.run AS r ON i.run_id = r.run_id
JOIN (
    VALUES ('a', $run_a, $a_window::BIGINT[]), ('b', $run_b, $b_window::BIGINT[])
) AS w (side, run_id, time_window)
    ON i.run_id = w.run_id
WHERE i.start_ns >= greatest(w.time_window[1], r.start_ns) + $skip_first * 1e9
    AND i.start_ns < coalesce(w.time_window[2], 9223372036854775807)
