-- title: Waits of callbacks, one by one
-- description: For every callback instance: the time since the end of the publication of its
--     message (or since the timer was due, or the request was sent), for how much of it the
--     executor was busy with other callbacks, as bounds, and with which. Instances nested in others
--     are left out. Where the kernel was traced, it shows when the message arrived, and for how
--     long the thread waited for a CPU.
-- grain: one row per callback instance that is not nested in another
-- param: callback_id BIGINT = NULL  Only instances of this callback_id (query waits lists  them)
-- param: min_busy_ns BIGINT {0..} = 0  Only waits in which the executor may have been busy for that
--     long [ns]
-- column: run_id
-- column: start_ns BIGINT [epoch ns]  Start of the callback
-- column: node, callback
-- column: since VARCHAR             Where the wait begins: 'publication', 'stamp', 'request' or
--     'timer'; empty: not known
-- column: wait_ns BIGINT [ns]       From there to the start of the callback
-- column: busy_min_ns BIGINT [ns]   Executor busy with others meanwhile, at least
-- column: busy_max_ns BIGINT [ns]   Executor busy with others meanwhile, at most
-- column: held_max_ns BIGINT [ns]  No thread of an executor of several waited for work meanwhile,
--     though not all ran callbacks; or the thread that ran this callback had picked it, and did not
--     start it yet. Of one thread: time between two waits without a callback, if that is a
--     millisecond or more
-- column: reason VARCHAR  What took the most of the wait, if the message came at once: 'executor
--     busy' (it ran others), 'all threads busy', 'excluded' (a callback ran that never runs beside
--     this one) or 'network or idle'. Where the kernel was traced also 'run queue' (its thread
--     waited for a CPU) and 'until arrival'
-- column: rest_min_ns BIGINT [ns]   Network, idle or overhead, at least
-- column: rest_max_ns BIGINT [ns]   Network, idle or overhead, at most
-- column: meanwhile VARCHAR         What ran meanwhile and for how long, the longest first, with
--     its node if it is another one
-- column: until_arrival_ns BIGINT [ns]  Until the message arrived; empty: neither the kernel nor
--     CARET shows that exactly
-- column: run_queue_ns BIGINT [ns]  From then on (else from when it can have been ready), its
--     thread was woken and waited for a CPU, outside of callbacks; empty: not traced by the kernel
-- column: preempted_ns
-- column: cpu_taken_by VARCHAR      What had the CPU in both, and for how long, the longest first
-- column: is_loss_affected
-- column: callback_instance_id BIGINT  Identity of the callback instance
-- column: callback_id, is_internal
-- brief: start_ns, node, callback, wait_ns (slowest), reason, busy_max_ns, meanwhile, run_queue_ns,
--     cpu_taken_by, preempted_ns, until_arrival_ns, busy_min_ns, since, rest_max_ns, rest_min_ns,
--     callback_instance_id
-- note: clocks
WITH waited AS MATERIALIZED (
    SELECT
        *,
        executor_id IN (
            SELECT executor_id FROM main.executor WHERE kind NOT LIKE 'multi_threaded%'
        ) OR held_max_ns IS NULL AS is_alone
    FROM main.executor_wait_explained($runs)
    WHERE start_ns >= $start_ns
        AND start_ns < $end_ns
        AND coalesce(callback_id = $callback_id, true)
        AND coalesce(busy_max_ns, busy_min_ns) >= $min_busy_ns
),
pair AS (
    SELECT
        callback_instance_id, callback_id,
        unnest(meanwhile_callback_ids) AS meanwhile_callback_id,
        unnest(meanwhile_ns) AS overlap_ns
    FROM waited
),
meanwhile AS (
    SELECT
        p.callback_instance_id,
        string_agg(
            CASE WHEN o.node = l.node THEN '' ELSE o.node || ' ' END
            || printf('%s %.3f ms', o.label, p.overlap_ns / 1e6),
            ', ' ORDER BY p.overlap_ns DESC, p.meanwhile_callback_id
        ) AS names
    FROM pair AS p
    JOIN main.callback_label AS l ON p.callback_id = l.callback_id
    JOIN main.callback_label AS o ON p.meanwhile_callback_id = o.callback_id
    GROUP BY p.callback_instance_id
),
taken AS (
    SELECT
        callback_instance_id,
        unnest(cpu_taken_by) AS name,
        unnest(cpu_taken_ns) AS length_ns
    FROM waited
),
taker AS (
    SELECT
        callback_instance_id,
        string_agg(
            printf('%s %.3f ms', name, length_ns / 1e6), ', ' ORDER BY length_ns DESC, name
        ) AS names
    FROM taken
    GROUP BY callback_instance_id
)
SELECT
    w.run_id, w.start_ns, l.node,
    l.label AS callback,
    w.since, w.wait_ns, w.busy_min_ns, w.busy_max_ns, w.held_max_ns,
    CASE
        WHEN w.wait_ns IS NULL OR w.busy_max_ns IS NULL THEN NULL
        WHEN 2 * (w.run_queue_ns + w.preempted_ns) > w.wait_ns THEN 'run queue'
        WHEN 2 * w.until_arrival_ns > w.wait_ns THEN 'until arrival'
        WHEN 2 * (w.busy_max_ns + coalesce(w.held_max_ns, 0)) < w.wait_ns THEN 'network or idle'
        WHEN 2 * w.blocked_max_ns > w.busy_max_ns + coalesce(w.held_max_ns, 0) THEN 'excluded'
        WHEN w.is_alone THEN 'executor busy'
        ELSE 'all threads busy'
    END AS reason,
    w.wait_ns - w.busy_max_ns - coalesce(w.held_max_ns, 0) AS rest_min_ns,
    w.wait_ns - w.busy_min_ns AS rest_max_ns,
    m.names AS meanwhile,
    w.until_arrival_ns, w.run_queue_ns, w.preempted_ns,
    k.names AS cpu_taken_by,
    w.is_loss_affected, w.callback_instance_id, w.callback_id, l.is_internal
FROM waited AS w
JOIN main.callback_label AS l ON w.callback_id = l.callback_id
LEFT JOIN meanwhile AS m ON w.callback_instance_id = m.callback_instance_id
LEFT JOIN taker AS k ON w.callback_instance_id = k.callback_instance_id
ORDER BY w.run_id, w.start_ns, w.callback_instance_id
