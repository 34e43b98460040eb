-- name: main.executor_wait_explained
-- kind: macro
-- description: How long callback instances waited in their executor (main.executor_wait), and which
--     callbacks its threads ran meanwhile (main.executor_interference, summed up by callback). Both
--     at once take hardly longer than one of them.
-- grain: one row per callback instance that is not nested in another
-- param: runs BIGINT[]  Runs to look at
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
-- column: idle_ns BIGINT [ns]  Executor waiting for work from earliest_ns on; NULL: not known
-- column: is_loss_affected BOOLEAN  A gap of the trace lies in it
-- column: meanwhile_callback_ids BIGINT[]  Callbacks that ran meanwhile, the longest first;
--     NULL: none
-- column: meanwhile_ns BIGINT[] [ns]  How long each of them did, from earliest_ns on (from
--     latest_ns if that is unknown); those on several threads may lie side by side
CREATE OR REPLACE MACRO main.executor_wait_explained(runs) AS TABLE
WITH executor AS (
    SELECT executor_id, NULL::BIGINT AS until_ns
    FROM derive.executor_size
    WHERE list_contains(runs, run_id)
),
ready AS MATERIALIZED (
    SELECT
        run_id, executor_id, thread_id, callback_id, callback_instance_id, since, origin_ns,
        earliest_ns, latest_ns, start_ns, thread_count, wait_start_ns, wait_end_ns,
        wait_before_ns, previous_wait_end_ns, is_loss_affected
    FROM derive.callback_ready('executor')
),
-- Of bursts there are far more pairs than waits: nothing may keep them all.
together AS (
    SELECT
        callback_instance_id, meanwhile_callback_id AS callback_id,
        sum(overlap_ns)::BIGINT AS overlap_ns
    FROM derive.executor_meanwhile('ready')
    WHERE overlap_ns > 0
    GROUP BY callback_instance_id, meanwhile_callback_id
),
listed AS (
    SELECT
        callback_instance_id,
        list(callback_id ORDER BY overlap_ns DESC, callback_id) AS meanwhile_callback_ids,
        list(overlap_ns ORDER BY overlap_ns DESC, callback_id) AS meanwhile_ns
    FROM together
    GROUP BY callback_instance_id
)
SELECT
    w.run_id, w.callback_instance_id, w.executor_id, w.thread_id, w.callback_id, w.since,
    w.origin_ns, w.earliest_ns, w.latest_ns, w.start_ns, w.wait_ns, w.busy_min_ns, w.busy_max_ns,
    w.blocked_max_ns, w.idle_ns, w.is_loss_affected,
    m.meanwhile_callback_ids, m.meanwhile_ns
FROM derive.executor_waits('ready') AS w
LEFT JOIN listed AS m ON w.callback_instance_id = m.callback_instance_id
