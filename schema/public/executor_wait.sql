-- description: How long callback instances waited in their executor, and what for. A trace does not
--     say when an input arrived: it became ready between earliest_ns and latest_ns. It could not
--     start (the executor was busy) while all threads ran callbacks, or one ran that excludes it.
--     The rest of the time was the network, an idle executor, or its own overhead. Callback
--     instances nested in others are left out.
-- grain: one row per callback instance that is not nested in another
-- column: run_id BIGINT  Run that the row belongs to
-- column: callback_instance_id BIGINT  Callback instance that waited
-- column: executor_id BIGINT  Its executor
-- column: thread_id BIGINT  Thread that ran it
-- column: callback_id BIGINT  Its callback
-- column: since VARCHAR  What origin_ns is: 'publication' (its end), 'stamp' (of a message whose
--     publication is not known, by the clock of its host), 'request' (sent), 'timer' (due);
--     NULL: not known
-- column: origin_ns BIGINT [epoch ns]  Moment from which it can have been due
-- column: earliest_ns BIGINT [epoch ns]  It was not ready before; NULL: not known
-- column: latest_ns BIGINT [epoch ns]  It was ready by then
-- column: start_ns BIGINT [epoch ns]  callback_start
-- column: wait_ns BIGINT [ns]  From origin_ns to start_ns
-- column: busy_min_ns BIGINT [ns]  Executor busy with other callbacks from latest_ns on
-- column: busy_max_ns BIGINT [ns]  Executor busy with other callbacks from earliest_ns on
-- column: blocked_max_ns BIGINT [ns]  Part of busy_max_ns for which a thread was free, but a
--     callback ran that never runs beside this one
-- column: idle_ns BIGINT [ns]  Executor waiting for work from earliest_ns on, until a thread
--     picked this callback; NULL: not known
-- column: is_loss_affected BOOLEAN  A gap of the trace lies in it
-- column: held_max_ns BIGINT [ns]  From earliest_ns on, no thread of an executor of several waited
--     for work, though not all ran callbacks: they were blocked by its lock, or looked for work;
--     or the thread that ran this callback had picked it, and did not start it yet. Not part of
--     busy_max_ns. Of an executor of one thread: the time between two waits for which it ran no
--     callback, if that is a millisecond or more. NULL: not known, or less
WITH executor AS (SELECT executor_id, NULL::BIGINT AS until_ns FROM derive.executor_size),
ready AS (FROM derive.callback_ready('executor'))
SELECT
    run_id, callback_instance_id, executor_id, thread_id, callback_id, since, origin_ns,
    earliest_ns, latest_ns, start_ns, wait_ns, busy_min_ns, busy_max_ns, blocked_max_ns, idle_ns,
    is_loss_affected, held_max_ns
FROM derive.executor_waits('ready')
