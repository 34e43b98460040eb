-- title: An executor that waits busily
-- description: The threads of an executor looked for work many times as often as they found some.
--     That costs CPU time, which callbacks may lack, and most of the events of the trace are about
--     it. Nothing is wrong with the recording.
-- cause: While a callback of a mutually exclusive group runs, other callbacks of the group that are
--     ready wake the MultiThreadedExecutor of rclcpp again and again, and it may not run them. That
--     of rclpy looks again and again until a thread of its pool begins a callback, and can keep
--     that thread from running Python for hundreds of milliseconds.
-- cure: Give callbacks that may run at once groups of their own or a reentrant group, or the nodes
--     single-threaded executors. Where the events of looking for work fill the buffers, leave them
--     out: msgflow record --without rclcpp_executor_wait_for_work,rclcpp_executor_get_next_ready
-- grain: one row per executor
-- severity: warning
-- when: store.executor WHERE kind LIKE 'multi_threaded%'
WITH waited AS (
    SELECT
        s.run_id, s.executor_id,
        count(*) AS number,
        count(DISTINCT s.thread_id) AS threads
    FROM derive.executor_interval AS s
    SEMI JOIN (FROM store.executor WHERE kind LIKE 'multi_threaded%') AS e
        ON s.executor_id = e.executor_id
    -- Over within a millisecond: something was ready.
    WHERE s.state = 'wait' AND s.end_ns - s.start_ns < 1_000_000
    GROUP BY s.run_id, s.executor_id
),
thread AS (
    FROM store.executor_thread
    SEMI JOIN (FROM store.executor WHERE kind LIKE 'multi_threaded%') USING (executor_id)
),
-- Those of clients and action servers are not traced, but what they are called with is.
run AS (
    SELECT thread_id FROM store.callback_instance
    UNION ALL
    SELECT receiver_thread_id FROM store.request WHERE callback_instance_id IS NULL
    UNION ALL
    SELECT receiver_thread_id FROM store.response
),
ran AS (
    SELECT
        x.executor_id,
        count(*) AS number
    FROM run AS i
    JOIN thread AS x ON i.thread_id = x.thread_id
    GROUP BY x.executor_id
)
SELECT
    w.run_id, e.process_id,
    w.number AS count,
    printf(
        '%d short waits for %s on %s: %d for each',
        w.number, derive.counted(r.number, 'callback'), derive.counted(w.threads, 'thread'),
        w.number // r.number
    ) AS detail
FROM waited AS w
JOIN ran AS r ON w.executor_id = r.executor_id
JOIN main.executor AS e ON w.executor_id = e.executor_id
-- One that sleeps until a callback is due waits once for it, or a few times: it is woken for what
-- it does for itself, too. One that is busy waits twenty times and more.
WHERE w.number > 10 * r.number
