-- title: Callback durations and periods
-- description: How long callbacks ran, and how far apart their starts were. Instances without an
--     end are counted separately. CPU time stands beside the duration where it is known: the rest
--     of the duration they slept, or waited for a CPU, which a kernel trace tells apart. The
--     longest 99th percentile comes first.
-- grain: one row per callback object that ran; one for all timers that a node made of one function
--     and period
-- variant: each BOOLEAN = false  Each callback instance, the longest first
-- column: run_id, node, callback
-- column: objects BIGINT            Callback objects that it stands for, timers made anew
-- column: count
-- column: open BIGINT               Instances without an end
-- column: rate_hz DOUBLE [Hz]      Instances per second, from the first start to the last; NULL:
--     these are less than half of the recording or time window apart, such as in a burst
-- column: period_min_ns BIGINT [ns]     Shortest time from one start to the next
-- column: period_median_ns
-- column: period_max_ns BIGINT [ns]     Longest time from one start to the next
-- column: min_ns BIGINT [ns]        Shortest duration
-- column: median_ns, mean_ns, p95_ns, p99_ns, max_ns, total_ns
-- column: running_median_ns BIGINT [ns]  Median CPU time; empty: not known
-- column: running_p99_ns
-- column: cpu_share DOUBLE [share]  CPU time divided by duration, of those with known CPU time
-- column: preempted_p99_ns BIGINT [ns]  99 % lost the CPU for at most this long
-- column: preempted_ns BIGINT [ns]      Sum of the time for which they had lost it
-- column: symbol
-- column: callback_id BIGINT        Identity of the callback, of the first of several
-- column: is_internal
-- brief: node, callback, count, median_ns, p99_ns, max_ns, running_p99_ns, cpu_share,
--     preempted_p99_ns, p95_ns, period_median_ns, mean_ns
-- note: callbacks
WITH instance AS (
    SELECT
        i.run_id,
        k.alike_id AS callback_id,
        k.objects, i.start_ns,
        i.end_ns - i.start_ns AS duration_ns,
        i.start_ns - lag(i.start_ns) OVER (
            PARTITION BY i.callback_id ORDER BY i.start_ns, i.callback_instance_id
        ) AS period_ns,
        i.cpu_ns, s.preempted_ns
    FROM main.callback_instance AS i
    JOIN main.callback_alike AS k ON i.callback_id = k.callback_id
    LEFT JOIN main.callback_schedule AS s ON i.callback_instance_id = s.callback_instance_id
    WHERE list_contains($runs, i.run_id) AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
),
measured AS (
    SELECT
        run_id, callback_id,
        any_value(objects) AS objects,
        count(*) AS count,
        count(*) - count(duration_ns) AS open,
        max(start_ns) - min(start_ns) AS span_ns,
        min(period_ns) AS period_min_ns,
        quantile_disc(period_ns, 0.5) AS period_median_ns,
        max(period_ns) AS period_max_ns,
        main.spread(duration_ns) AS duration,
        sum(duration_ns)::BIGINT AS total_ns,
        quantile_disc(cpu_ns, [0.5, 0.99]) AS running,
        sum(cpu_ns) / sum(duration_ns) FILTER (WHERE cpu_ns IS NOT NULL) AS cpu_share,
        quantile_disc(preempted_ns, 0.99) AS preempted_p99_ns,
        sum(preempted_ns)::BIGINT AS preempted_ns
    FROM instance
    GROUP BY run_id, callback_id
)
SELECT
    m.run_id, l.node,
    l.label AS callback,
    m.objects, m.count, m.open,
    CASE WHEN
            2 * m.span_ns >= coalesce(
                r.end_ns + least(0, $end_ns - r.end_ns) - greatest(r.start_ns, $start_ns), 0
            )
            THEN (m.count - 1) * 1e9 / nullif(m.span_ns, 0)
    END AS rate_hz,
    m.period_min_ns, m.period_median_ns, m.period_max_ns,
    unnest(m.duration),
    m.total_ns,
    m.running[1] AS running_median_ns,
    m.running[2] AS running_p99_ns,
    m.cpu_share, m.preempted_p99_ns, m.preempted_ns, c.symbol, m.callback_id, l.is_internal
FROM measured AS m
JOIN main.callback_label AS l ON m.callback_id = l.callback_id
JOIN main.run AS r ON m.run_id = r.run_id
JOIN main.callback AS c ON m.callback_id = c.callback_id
ORDER BY m.run_id, m.duration.p99_ns DESC NULLS LAST, l.node, l.label, m.callback_id
