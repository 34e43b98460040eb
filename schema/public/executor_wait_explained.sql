-- description: How long callback instances waited in their executor (main.executor_wait), and which
--     callbacks its threads ran meanwhile (main.executor_interference, summed up by callback). Both
--     at once take hardly longer than one of them. Where a kernel trace or CARET shows exactly
--     when a message arrived (main.arrival), it was ready then: the bounds are one.
-- grain: one row per callback instance that is not nested in another
-- param: runs
-- param: arrivals VARCHAR = 'arrival_here'  Name of a table with take_id, until_arrival_ns,
--     run_queue_ns and executor_ns of the exact rows of main.arrival, where there is one
-- param: waits, has_kernel, has_teams
-- column: run_id
-- column: callback_instance_id BIGINT  Callback instance that waited
-- column: executor_id, thread_id, callback_id, since, origin_ns, earliest_ns, latest_ns
-- column: start_ns BIGINT [epoch ns]  callback_start
-- column: wait_ns, busy_min_ns, busy_max_ns, blocked_max_ns, idle_ns, is_loss_affected, held_max_ns
-- column: meanwhile_callback_ids BIGINT[]  Callbacks that ran meanwhile, the longest first;
--     NULL: none
-- column: meanwhile_ns BIGINT[] [ns]  For how long each of them did, from earliest_ns on (from
--     latest_ns if that is unknown). Several threads that ran one at once count once
-- column: meanwhile_certain_ns BIGINT[] [ns]  The same from latest_ns on
-- column: meanwhile_thread_ns BIGINT[] [ns]  The same as meanwhile_ns, of all threads added up
-- column: meanwhile_instances BIGINT[]  How many callback instances of each that were
-- column: until_arrival_ns BIGINT [ns]  From the end of the publication until its message arrived,
--     where a kernel trace or CARET shows that exactly; else NULL
-- column: run_queue_ns BIGINT [ns]  From earliest_ns on (from latest_ns if that is unknown), its
--     thread was woken and waited for a CPU, outside of callbacks; NULL: not traced by the kernel
-- column: preempted_ns
-- column: cpu_taken_by VARCHAR[]  Threads that had the CPU in both, the longest first; NULL: none
-- column: cpu_taken_ns BIGINT[] [ns]  For how long each of them did
CREATE OR REPLACE MACRO main.executor_wait_explained(
    runs, arrivals := 'arrival_here', waits := 'wait_here', has_kernel := true, has_teams := true
) AS TABLE
WITH executor AS (
    SELECT
        executor_id,
        NULL::BIGINT AS until_ns
    FROM derive.executor_size
    WHERE list_contains(runs, run_id)
),
arrival_here AS MATERIALIZED (
    FROM main.arrival
    WHERE list_contains(runs, run_id) AND is_exact AND executor_ns IS NOT NULL
),
wait_here AS NOT MATERIALIZED (FROM derive.callback_ready('executor')),
arrived AS (
    SELECT
        i.callback_instance_id, a.until_arrival_ns,
        t.taken_ns - coalesce(a.run_queue_ns, 0) - a.executor_ns AS arrived_ns
    FROM query_table(arrivals) AS a
    JOIN store.take AS t ON a.take_id = t.take_id
    JOIN store.callback_instance AS i ON a.take_id = i.take_id
),
ready AS MATERIALIZED (
    SELECT
        r.run_id, r.executor_id, r.thread_id, r.callback_id, r.callback_instance_id, r.since,
        r.origin_ns,
        coalesce(a.arrived_ns, r.earliest_ns) AS earliest_ns,
        coalesce(a.arrived_ns, r.latest_ns) AS latest_ns,
        r.start_ns, r.thread_count, r.picked_ns, r.wait_start_ns, r.previous_wait_end_ns,
        r.is_loss_affected, a.until_arrival_ns
    FROM query_table(waits) AS r
    LEFT JOIN arrived AS a ON r.callback_instance_id = a.callback_instance_id
),
-- Of bursts there are far more pairs than waits: nothing may keep them all.
together AS (
    SELECT
        callback_instance_id,
        any_value(executor_id) AS executor_id,
        meanwhile_callback_id AS callback_id,
        count(*) AS instances,
        sum(overlap_ns)::BIGINT AS thread_ns,
        sum(certain_ns)::BIGINT AS certain_ns
    FROM derive.executor_meanwhile('ready')
    WHERE overlap_ns > 0
    GROUP BY callback_instance_id, meanwhile_callback_id
),
-- With several threads: for how long at least one of them had run the callback, up to a moment.
moment AS (
    SELECT
        t.callback_instance_id, t.executor_id, t.callback_id,
        unnest(['from', 'latest', 'start']) AS which,
        unnest([coalesce(r.earliest_ns, r.latest_ns), r.latest_ns, r.start_ns]) AS at_ns
    FROM together AS t
    JOIN ready AS r ON t.callback_instance_id = r.callback_instance_id
    WHERE has_teams AND r.thread_count > 1
),
ran AS (
    SELECT
        m.callback_instance_id, m.callback_id, m.which,
        derive.passed_ns(s, m.at_ns) AS until_ns
    FROM moment AS m
    ASOF LEFT JOIN derive.callback_running AS s
        ON m.executor_id = s.executor_id AND m.callback_id = s.callback_id
            AND m.at_ns >= s.start_ns
),
once AS (
    SELECT
        callback_instance_id,
        callback_id,
        max(until_ns) FILTER (WHERE which = 'start') - max(until_ns) FILTER (WHERE which = 'from')
            AS overlap_ns,
        max(until_ns) FILTER (WHERE which = 'start') - max(until_ns) FILTER (WHERE which = 'latest')
            AS certain_ns
    FROM ran
    WHERE has_teams
    GROUP BY callback_instance_id, callback_id
),
told AS (
    SELECT
        t.callback_instance_id, t.callback_id, t.instances, t.thread_ns,
        coalesce(o.overlap_ns, t.thread_ns) AS overlap_ns,
        coalesce(o.certain_ns, t.certain_ns) AS certain_ns
    FROM together AS t
    LEFT JOIN once AS o
        ON t.callback_instance_id = o.callback_instance_id AND t.callback_id = o.callback_id
),
listed AS (
    SELECT
        callback_instance_id,
        list(callback_id ORDER BY overlap_ns DESC, callback_id) AS meanwhile_callback_ids,
        list(overlap_ns ORDER BY overlap_ns DESC, callback_id) AS meanwhile_ns,
        list(certain_ns ORDER BY overlap_ns DESC, callback_id) AS meanwhile_certain_ns,
        list(thread_ns ORDER BY overlap_ns DESC, callback_id) AS meanwhile_thread_ns,
        list(instances ORDER BY overlap_ns DESC, callback_id) AS meanwhile_instances
    FROM told
    GROUP BY callback_instance_id
)
SELECT
    w.run_id, w.callback_instance_id, w.executor_id, w.thread_id, w.callback_id, w.since,
    w.origin_ns, w.earliest_ns, w.latest_ns, w.start_ns, w.wait_ns, w.busy_min_ns, w.busy_max_ns,
    w.blocked_max_ns, w.idle_ns, w.is_loss_affected,
    w.held_max_ns, m.meanwhile_callback_ids, m.meanwhile_ns, m.meanwhile_certain_ns,
    m.meanwhile_thread_ns, m.meanwhile_instances, r.until_arrival_ns, q.run_queue_ns,
    q.preempted_ns, q.cpu_taken_by, q.cpu_taken_ns
FROM derive.executor_waits('ready', has_teams) AS w
JOIN ready AS r ON w.callback_instance_id = r.callback_instance_id
LEFT JOIN (FROM derive.executor_queue('ready') WHERE has_kernel) AS q
    ON w.callback_instance_id = q.callback_instance_id
LEFT JOIN listed AS m ON w.callback_instance_id = m.callback_instance_id
