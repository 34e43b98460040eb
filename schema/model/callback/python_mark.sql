-- description: What the tracer of Python nodes (msgflow record) says besides the events of rclcpp:
--     which processes it traces (`python`), which executor a thread works for (`executor`), where
--     the function of a callback begins (`source`), that something will go on later because of what
--     runs (`step`), that the next callback of the thread is what goes on (`resume`; `job`: on a
--     thread of no executor), the CPU time of what has just ended (`cpu`) and the duration of a
--     collection of garbage that has (`collect`) [ns], how Python calls a thread (`thread`), and
--     why it traces the process no longer (`off`).
--     The tracer registers a callback that never runs, whose symbol says it.
-- grain: one row per such event
-- when: raw.ros2_rclcpp_callback_register WHERE symbol LIKE '#msgflow %'
SELECT
    event_id, ts_ns, thread_id, process_id,
    callback AS number,
    split_part(symbol, ' ', 2) AS kind,
    substr(symbol, 11 + length(split_part(symbol, ' ', 2))) AS text,
    previous_callback_event_id, previous_executor_event_id
FROM staging.located('raw.ros2_rclcpp_callback_register')
WHERE symbol LIKE '#msgflow %' AND symbol NOT LIKE '#msgflow function %'
