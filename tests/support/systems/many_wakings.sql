-- A callback of a timer that began 150 times, woken each time, and slept in between.
INSERT INTO store.timer (timer_id, run_id, process_id, node_id, period_ns, created_ns)
VALUES (1, 1, 1, 1, 10000, 0);
INSERT INTO store.callback (callback_id, run_id, process_id, node_id, kind, timer_id)
VALUES (1, 1, 1, 1, 'timer', 1);
INSERT INTO store.callback_instance
    (callback_instance_id, run_id, trace_id, callback_id, process_id, thread_id, start_ns, end_ns,
     is_intra_process, depth, start_event_id, end_event_id, effective_end_event_id)
SELECT
    i, 1, 1, 1, 1, 1, 10000 * i, 10000 * i + 3000 + 7 * i, false, 1, 2 * i, 2 * i + 1, 2 * i + 1
FROM range(1, 151) AS r(i);
INSERT INTO store.callback_schedule
    (run_id, callback_instance_id, running_ns, preempted_ns, runnable_ns, sleeping_ns,
     uninterruptible_ns, unknown_ns, preemption_count, migration_count)
SELECT 1, i, 1000 + 3 * i, 500 + i, 0, 1500 + 3 * i, 0, 0, 1, i % 2
FROM range(1, 151) AS r(i);
INSERT INTO store.thread_state (run_id, thread_id, start_ns, end_ns, state, cpu, priority)
SELECT 1, 1, 10000 * i - 100 - 2 * i, 10000 * i - 100, 'runnable', 0, 120
FROM range(1, 151) AS r(i);
