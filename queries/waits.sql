-- title: How long callbacks waited, and what their executor ran meanwhile
-- description: The time from the end of a publication (or from when a timer was due, or a request
--     was sent) to the start of its callback, and how much of it the executor was busy with other
--     callbacks. A trace does not say when a message arrived, so the busy time is given as bounds:
--     at least what ran after the executor had certainly found it ready, at most what ran since the
--     earliest moment at which it can have been there. The rest was the network, an idle executor
--     or its overhead, and where the kernel was traced the time until the message arrived and the
--     wait for a CPU. The callback that others kept waiting longest comes first. With --by
--     instance, the waits are listed one by one, with --by pair, the callbacks that ran meanwhile.
-- grain: one row per callback object that ran; one for all timers that a node made of one function
--     and period
-- variant: by VARCHAR {callback|pair|instance} = 'callback'  What a row is: a callback that
--     waited, with another that ran meanwhile, or one of its waits
-- column: run_id, node, callback, count
-- column: delayed_min BIGINT        Of these, certainly kept waiting: ready while others ran
-- column: delayed_max BIGINT        Of these, possibly kept waiting
-- column: wait_median_ns BIGINT [ns]  Median wait, where its start is known
-- column: wait_max_ns BIGINT [ns]   Longest wait
-- column: busy_worst_ns BIGINT [ns]   Longest time for which the executor can have been busy during
--     one wait
-- column: busy_total_min_ns BIGINT [ns]  Executor busy with others during all waits, at least
-- column: busy_total_max_ns BIGINT [ns]  Executor busy with others during all waits, at most
-- column: held_total_max_ns BIGINT [ns]  No thread of an executor of several waited for work
--     meanwhile, though not all ran callbacks, at most
-- column: rest_total_min_ns BIGINT [ns]  Network, idle or overhead, where known, at least
-- column: rest_total_max_ns BIGINT [ns]  Network, idle or overhead, where known, at most
-- column: meanwhile VARCHAR         What ran meanwhile: the three with the largest share, with
--     their node if it is another one
-- column: arrived BIGINT            Waits whose message has an exact arrival; empty: neither
--     the kernel nor CARET tells
-- column: until_arrival_total_ns BIGINT [ns]  Sum of the times until these messages arrived
-- column: run_queue_worst_ns BIGINT [ns]  Longest time in one wait for which its thread was woken
--     and waited for a CPU, outside of callbacks, since the message arrived (else since it can have
--     been ready)
-- column: run_queue_total_ns BIGINT [ns]  Sum of these times over all waits
-- column: preempted_worst_ns BIGINT [ns]  Likewise, its thread had more to do, but had lost the CPU
-- column: preempted_total_ns BIGINT [ns]  Sum of these times over all waits
-- column: cpu_taken_by VARCHAR      What had the CPU in both: the three with the largest share;
--     'idle CPU': nothing, for a millisecond or more (main.withheld_cpu)
-- column: unknown BIGINT            Of these, with an unknown start of the wait
-- column: loss_affected BIGINT      Of these, with a gap of the trace in their wait
-- column: callback_id, is_internal
-- brief: node, callback, busy_worst_ns, wait_median_ns, wait_max_ns, run_queue_worst_ns,
--     meanwhile, cpu_taken_by, preempted_worst_ns, count, delayed_min, delayed_max,
--     busy_total_min_ns, busy_total_max_ns
-- note: clocks
WITH waited AS MATERIALIZED (
    SELECT w.* REPLACE (k.alike_id AS callback_id)
    FROM main.executor_wait_explained($runs) AS w
    JOIN main.callback_alike AS k ON w.callback_id = k.callback_id
    WHERE w.start_ns >= $start_ns AND w.start_ns < $end_ns
),
measured AS (
    SELECT
        run_id, callback_id,
        count(*) AS count,
        count(*) FILTER (WHERE busy_min_ns > 0) AS delayed_min,
        count(*) FILTER (WHERE coalesce(busy_max_ns, busy_min_ns) > 0) AS delayed_max,
        quantile_disc(wait_ns, 0.5) AS wait_median_ns,
        max(wait_ns) AS wait_max_ns,
        max(busy_max_ns) AS busy_worst_ns,
        sum(busy_min_ns)::BIGINT AS busy_total_min_ns,
        sum(coalesce(busy_max_ns, busy_min_ns))::BIGINT AS busy_total_max_ns,
        sum(CASE WHEN wait_ns IS NOT NULL THEN held_max_ns END)::BIGINT AS held_total_max_ns,
        sum(wait_ns - busy_max_ns - coalesce(held_max_ns, 0))::BIGINT AS rest_total_min_ns,
        sum(wait_ns - busy_min_ns)::BIGINT AS rest_total_max_ns,
        CASE WHEN count(run_queue_ns) + count(until_arrival_ns) > 0 THEN count(until_arrival_ns) END
            AS arrived,
        sum(until_arrival_ns)::BIGINT AS until_arrival_total_ns,
        max(run_queue_ns) AS run_queue_worst_ns,
        sum(run_queue_ns)::BIGINT AS run_queue_total_ns,
        max(preempted_ns) AS preempted_worst_ns,
        sum(preempted_ns)::BIGINT AS preempted_total_ns,
        count(*) - count(wait_ns) AS unknown,
        count(*) FILTER (WHERE is_loss_affected) AS loss_affected
    FROM waited
    GROUP BY run_id, callback_id
),
taken AS (
    SELECT
        callback_id,
        unnest(cpu_taken_by) AS name,
        unnest(cpu_taken_ns) AS length_ns
    FROM waited
),
taker AS (
    SELECT
        callback_id, name,
        sum(length_ns) / sum(sum(length_ns)) OVER (PARTITION BY callback_id) AS share,
        row_number() OVER (PARTITION BY callback_id ORDER BY sum(length_ns) DESC, name) AS place
    FROM taken
    GROUP BY callback_id, name
),
preemptor AS (
    SELECT
        callback_id,
        string_agg(printf('%s %.0f %%', name, 100 * share), ', ' ORDER BY place) AS shares
    FROM taker
    WHERE place <= 3 AND share >= 0.005
    GROUP BY callback_id
)
SELECT
    m.run_id, l.node,
    l.label AS callback,
    m.count, m.delayed_min, m.delayed_max, m.wait_median_ns, m.wait_max_ns, m.busy_worst_ns,
    m.busy_total_min_ns, m.busy_total_max_ns, m.held_total_max_ns, m.rest_total_min_ns,
    m.rest_total_max_ns,
    w.shares AS meanwhile,
    m.arrived, m.until_arrival_total_ns, m.run_queue_worst_ns, m.run_queue_total_ns,
    m.preempted_worst_ns, m.preempted_total_ns,
    p.shares AS cpu_taken_by,
    m.unknown, m.loss_affected, m.callback_id, l.is_internal
FROM measured AS m
JOIN main.callback_label AS l ON m.callback_id = l.callback_id
LEFT JOIN main.meanwhile_share('waited') AS w ON m.callback_id = w.callback_id
LEFT JOIN preemptor AS p ON m.callback_id = p.callback_id
ORDER BY m.run_id, m.busy_worst_ns DESC NULLS LAST, l.node, l.label, m.callback_id
