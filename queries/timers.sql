-- title: Whether timers keep their period, how late they are called, and why
-- description: Jitter is how far the time from one start of the callback to the next differs from
--     the period asked for (from the median, if the trace does not have it). Lateness is the time
--     from when the timer was due to the start of the callback: it is due at the first moment after
--     its previous call that is a whole number of periods after its creation. So a call that is a
--     period late or more replaces those that were due meanwhile (missed), and is followed by one
--     sooner than usual (bunched). An events executor queues calls: none is missed. A timer waits
--     for what its executor runs, else for the executor itself, or for a CPU. Calls after a gap of
--     the trace are not counted.
-- grain: one row per timer, called or not; one for all timers that a node made of one function and
--     period
-- column: run_id
-- column: node VARCHAR [node]       Node of the timer
-- column: callback VARCHAR [callback]  The timer, by its period
-- column: objects BIGINT            Timers that it stands for
-- column: period_ns BIGINT [ns]     Period asked for; empty: not in the trace
-- column: period_median_ns
-- column: rate_hz DOUBLE [Hz]       Calls per second, from the first to the last
-- column: recording_rate_hz
-- column: count BIGINT              Calls that began in the time window
-- column: missed BIGINT             Calls that did not happen, since the one before was late by
--     whole periods
-- column: bunched BIGINT            Calls less than half a period after the one before
-- column: jitter_median_ns BIGINT [ns]  Median of the jitter
-- column: jitter_p95_ns BIGINT [ns]  95 % of the jitter values are at most this
-- column: jitter_p99_ns BIGINT [ns]  99 % of the jitter values are at most this
-- column: jitter_max_ns BIGINT [ns]  Greatest jitter
-- column: lateness_median_ns BIGINT [ns]  Median lateness
-- column: lateness_p95_ns BIGINT [ns]  95 % of the calls were at most this late
-- column: lateness_p99_ns BIGINT [ns]  99 % of the calls were at most this late
-- column: lateness_max_ns BIGINT [ns]  Greatest lateness
-- column: off_grid VARCHAR          Why its lateness is not known: 'reset', since it keeps its
--     period at other instants than its creation suggests; 'clock', since it keeps another period
--     (simulated time)
-- column: busy_share DOUBLE [share] Share of all lateness for which the executor was busy with
--     callbacks, 0 to 1
-- column: run_queue_share DOUBLE [share] Share of all lateness for which its thread waited for a
--     CPU outside of callbacks, 0 to 1; empty: not traced by the kernel
-- column: meanwhile VARCHAR         What ran in that time: the three with the largest share, with
--     their node if it is another one
-- column: unknown BIGINT            Of count, those whose due moment is not known, such as the
--     first call
-- column: loss_affected BIGINT      Of count, those with a gap of the trace since the call before
-- column: symbol
-- column: timer_id BIGINT           Identity of the timer, of the first of several
-- column: callback_id BIGINT        Identity of the callback, of the first of several
-- column: is_internal
-- brief: node, callback, count, missed, lateness_p99_ns, lateness_max_ns, off_grid, jitter_p99_ns,
--     meanwhile, objects, busy_share, run_queue_share, lateness_median_ns, rate_hz,
--     recording_rate_hz, bunched
-- note: callbacks
WITH asked AS (
    SELECT
        c.run_id, c.callback_id, c.timer_id, c.symbol, t.period_ns, t.created_ns, k.alike_id,
        k.objects
    FROM main.callback AS c
    JOIN main.timer AS t ON c.timer_id = t.timer_id
    JOIN main.callback_alike AS k ON c.callback_id = k.callback_id
    WHERE list_contains($runs, c.run_id)
),
called AS (
    SELECT
        a.alike_id AS callback_id,
        a.created_ns, i.callback_instance_id, i.thread_id, x.executor_id, i.start_ns,
        lag(i.start_ns) OVER (
            PARTITION BY i.callback_id ORDER BY i.start_ns, i.callback_instance_id
        ) AS previous_ns
    FROM main.callback_instance AS i
    JOIN asked AS a ON i.callback_id = a.callback_id
    LEFT JOIN main.executor_thread AS x ON i.thread_id = x.thread_id
),
broken AS (
    SELECT x.executor_id, b.resumed_ns
    FROM main.thread_break AS b
    JOIN main.executor_thread AS x ON b.thread_id = x.thread_id
),
instance AS (
    SELECT
        c.callback_id, c.created_ns, c.callback_instance_id, c.thread_id, c.start_ns,
        c.start_ns - c.previous_ns AS interval_ns,
        coalesce(b.resumed_ns > c.previous_ns, false) AS is_loss_affected
    FROM called AS c
    ASOF LEFT JOIN broken AS b ON c.executor_id = b.executor_id AND c.start_ns >= b.resumed_ns
    WHERE c.start_ns >= $start_ns AND c.start_ns < $end_ns
),
-- Behind a gap the call before may be missing, and with it when this one was due.
late AS MATERIALIZED (
    SELECT
        i.callback_id, i.callback_instance_id, i.thread_id, i.start_ns,
        w.wait_ns AS lateness_ns,
        lead(w.origin_ns) OVER (
            PARTITION BY w.callback_id ORDER BY i.start_ns, i.callback_instance_id
        ) - w.origin_ns AS until_next_ns,
        w.busy_max_ns AS busy_ns,
        w.meanwhile_callback_ids, w.meanwhile_ns,
        w.run_queue_ns + w.preempted_ns AS queue_ns
    FROM instance AS i
    JOIN main.executor_wait_explained($runs) AS w ON i.callback_instance_id = w.callback_instance_id
    WHERE w.since = 'timer' AND NOT i.is_loss_affected
),
usual AS (
    SELECT
        callback_id,
        quantile_disc(interval_ns, 0.5) AS median_ns
    FROM instance
    WHERE NOT is_loss_affected
    GROUP BY callback_id
),
kept AS (
    SELECT
        i.callback_id,
        quantile_disc(
            abs(i.interval_ns - coalesce(a.period_ns, u.median_ns)), [0.5, 0.95, 0.99, 1]
        ) AS jitter,
        count(*) FILTER (WHERE 2 * i.interval_ns < coalesce(a.period_ns, u.median_ns)) AS bunched
    FROM instance AS i
    JOIN asked AS a ON i.callback_id = a.callback_id
    JOIN usual AS u ON i.callback_id = u.callback_id
    WHERE i.interval_ns IS NOT NULL AND NOT i.is_loss_affected
    GROUP BY i.callback_id
),
-- How far behind the grid of its creation a timer is called that does not keep it.
placed AS (
    SELECT
        i.callback_id,
        count(*) AS count,
        quantile_disc((i.start_ns - i.created_ns) % a.period_ns, [0.25, 0.75]) AS place
    FROM instance AS i
    JOIN asked AS a ON i.callback_id = a.callback_id
    ANTI JOIN late AS l ON i.callback_instance_id = l.callback_instance_id
    WHERE a.period_ns > 0
    GROUP BY i.callback_id
),
counted AS (
    SELECT
        callback_id,
        count(*) AS count,
        (count(*) - 1) * 1e9 / nullif(max(start_ns) - min(start_ns), 0) AS rate_hz,
        max(start_ns) - min(start_ns) AS span_ns,
        count(*) FILTER (WHERE is_loss_affected) AS loss_affected
    FROM instance
    GROUP BY callback_id
),
delayed AS (
    SELECT
        l.callback_id,
        count(*) AS known,
        quantile_disc(l.lateness_ns, [0.5, 0.95, 0.99, 1]) AS lateness,
        -- Moments that passed meanwhile, but for those of calls that an events executor queued.
        sum(least(
            l.lateness_ns // a.period_ns,
            (l.until_next_ns + a.period_ns // 2) // nullif(a.period_ns, 0) - 1
        ))::BIGINT AS missed,
        sum(l.busy_ns) / nullif(sum(l.lateness_ns), 0) AS busy_share,
        sum(l.queue_ns) / nullif(sum(l.lateness_ns), 0) AS run_queue_share
    FROM late AS l
    JOIN asked AS a ON l.callback_id = a.callback_id
    GROUP BY l.callback_id
)
SELECT
    a.run_id, n.node,
    n.label AS callback,
    a.objects, a.period_ns,
    u.median_ns AS period_median_ns,
    c.rate_hz,
    c.count * 1e9 / nullif(least(r.end_ns, $end_ns) - greatest(r.start_ns, $start_ns), 0)
        AS recording_rate_hz,
    coalesce(c.count, 0) AS count,
    d.missed, k.bunched,
    k.jitter[1] AS jitter_median_ns,
    k.jitter[2] AS jitter_p95_ns,
    k.jitter[3] AS jitter_p99_ns,
    k.jitter[4] AS jitter_max_ns,
    d.lateness[1] AS lateness_median_ns,
    d.lateness[2] AS lateness_p95_ns,
    d.lateness[3] AS lateness_p99_ns,
    d.lateness[4] AS lateness_max_ns,
    CASE
        -- On its grid a timer takes count - 2 periods for that many calls at the least. One more is
        -- for how long starting takes.
        WHEN c.span_ns * a.objects < (c.count - 3 * a.objects) * a.period_ns THEN 'clock'
        WHEN c.count >= 10 AND d.known IS NULL AND k.jitter[1] > a.period_ns // 10 THEN 'clock'
        -- Fewer than ten may be equally late by chance.
        WHEN
            g.count >= 10
            AND g.place[1] > least(a.period_ns // 10, 1000000)
            AND g.place[2] - g.place[1] <= a.period_ns // 10
            THEN 'reset'
    END AS off_grid,
    d.busy_share, d.run_queue_share,
    m.shares AS meanwhile,
    coalesce(c.count - c.loss_affected - coalesce(d.known, 0), 0) AS unknown,
    coalesce(c.loss_affected, 0) AS loss_affected,
    a.symbol, a.timer_id, a.callback_id, n.is_internal
FROM asked AS a
JOIN main.run AS r ON a.run_id = r.run_id
JOIN main.callback_label AS n ON a.callback_id = n.callback_id
LEFT JOIN counted AS c ON a.callback_id = c.callback_id
LEFT JOIN usual AS u ON a.callback_id = u.callback_id
LEFT JOIN kept AS k ON a.callback_id = k.callback_id
LEFT JOIN delayed AS d ON a.callback_id = d.callback_id
LEFT JOIN placed AS g ON a.callback_id = g.callback_id
LEFT JOIN main.meanwhile_share('late') AS m ON a.callback_id = m.callback_id
WHERE a.callback_id = a.alike_id
ORDER BY a.run_id, lateness_p99_ns DESC NULLS LAST, n.node, n.label, a.callback_id
