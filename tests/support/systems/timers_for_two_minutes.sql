-- Timers of 100 ms over two minutes, each alone in its executor. One follows a clock that runs 18 ppm
-- faster than that of the trace, one a clock that runs 18 ppm slower. One is reset after a minute.
-- One is late by 7 ms for three seconds, without a reason that the trace shows.
INSERT INTO store.node (node_id, run_id, process_id, name, namespace, full_name, is_inferred)
VALUES (1, 1, 1, 'n', '/', '/n', false);
INSERT INTO store.timer (timer_id, run_id, process_id, node_id, period_ns, created_ns)
SELECT t, 1, 1, 1, 100000000, 0 FROM range(1, 5) AS r (t);
INSERT INTO store.callback (callback_id, run_id, process_id, node_id, kind, timer_id, symbol)
SELECT t, 1, 1, 1, 'timer', t, ['fast', 'slow', 'reset', 'starved'][t] FROM range(1, 5) AS r (t);
INSERT INTO store.thread (thread_id, run_id, process_id, tid)
SELECT t, 1, 1, t FROM range(2, 5) AS r (t);
INSERT INTO store.executor (executor_id, run_id, process_id, kind, is_inferred)
SELECT t, 1, 1, 'single_threaded', true FROM range(1, 5) AS r (t);
INSERT INTO store.executor_thread (run_id, executor_id, thread_id)
SELECT 1, t, t FROM range(1, 5) AS r (t);
INSERT INTO store.callback_instance (
    callback_instance_id, run_id, trace_id, callback_id, process_id, thread_id, start_ns, end_ns,
    depth, start_event_id
)
SELECT 4 * n + t, 1, 1, t, 1, t, start_ns, start_ns + 200000, 1, 4 * n + t
FROM (
    SELECT
        n, t,
        100000000 * n + 50000 + 7000 * (n * n % 11) + CASE t
            WHEN 1 THEN -1800 * n
            WHEN 2 THEN 1800 * n
            WHEN 3 THEN CASE WHEN n >= 600 THEN 37000000 ELSE 0 END
            ELSE CASE WHEN n BETWEEN 700 AND 729 THEN 7000000 ELSE 0 END
        END AS start_ns
    FROM range(1, 1200) AS r (n), range(1, 5) AS s (t)
);
