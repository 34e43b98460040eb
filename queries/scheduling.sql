-- title: CPU time of callbacks, and what kept them from the CPU
-- description: How the time of callbacks divides into what their thread did, as a kernel trace
--     shows it (docs/scheduling.md). The parts add up to the durations. Without kernel traces there
--     are no rows. Callbacks that were kept from the CPU longest come first.
-- grain: one row per callback object
-- variant: measure VARCHAR {callbacks|threads|cpu|preemption|wakeup|programs} = 'callbacks'
--     What is measured: the states of callbacks, those of threads, the CPU time of threads of all
--     processes, which programs took the CPU from whom, how long woken threads waited for one, or
--     without a kernel trace the CPU time of all programs
-- column: run_id, node, callback
-- column: count BIGINT              Callback instances that began in the time window and ended
-- column: median_ns, max_ns
-- column: running_median_ns BIGINT [ns]  Median CPU time
-- column: running_p99_ns
-- column: running_max_ns BIGINT [ns]  Longest CPU time
-- column: total_ns
-- column: running_ns BIGINT [ns]    Of that, on a CPU
-- column: preempted_ns BIGINT [ns]  Of that, ready, but the CPU was taken away
-- column: runnable_ns BIGINT [ns]   Of that, woken, waiting for a CPU
-- column: sleeping_ns BIGINT [ns]   Of that, waiting for something
-- column: uninterruptible_ns BIGINT [ns]  Of that, waiting for a page or a disk
-- column: unknown_ns BIGINT [ns]    Of that, not known
-- column: irq_ns BIGINT [ns]        Of the time on a CPU, interrupts; NULL: not recorded
-- column: softirq_ns BIGINT [ns]    Of the time on a CPU, what interrupts left for later; NULL: not
--     recorded
-- column: preemptions BIGINT        How often the CPU was taken away
-- column: migrations BIGINT         How often a callback went on on another CPU
-- column: loss_affected BIGINT      Callback instances during which kernel events were lost
-- column: callback_id, is_internal
-- brief: node, callback, preempted_ns, median_ns, running_median_ns, running_p99_ns, count,
--     sleeping_ns, runnable_ns, preemptions, max_ns
-- note: kernel
WITH measured AS (
    SELECT
        i.run_id, i.callback_id,
        count(*) AS count,
        quantile_disc(i.end_ns - i.start_ns, 0.5) AS median_ns,
        max(i.end_ns - i.start_ns) AS max_ns,
        quantile_disc(s.running_ns, [0.5, 0.99]) AS quantiles,
        max(s.running_ns) AS running_max_ns,
        sum(i.end_ns - i.start_ns)::BIGINT AS total_ns,
        sum(COLUMNS([
            'running_ns', 'preempted_ns', 'runnable_ns', 'sleeping_ns', 'uninterruptible_ns',
            'unknown_ns', 'irq_ns', 'softirq_ns'
        ]))::BIGINT,
        sum(s.preemption_count)::BIGINT AS preemptions,
        sum(s.migration_count)::BIGINT AS migrations,
        count(*) FILTER (WHERE s.is_loss_affected) AS loss_affected
    FROM main.callback_schedule AS s
    JOIN main.callback_instance AS i ON s.callback_instance_id = i.callback_instance_id
    WHERE list_contains($runs, i.run_id) AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
    GROUP BY i.run_id, i.callback_id
)
SELECT
    m.run_id, l.node,
    l.label AS callback,
    m.count, m.median_ns, m.max_ns,
    m.quantiles[1] AS running_median_ns,
    m.quantiles[2] AS running_p99_ns,
    m.running_max_ns, m.total_ns, m.running_ns, m.preempted_ns, m.runnable_ns, m.sleeping_ns,
    m.uninterruptible_ns, m.unknown_ns, m.irq_ns, m.softirq_ns, m.preemptions, m.migrations,
    m.loss_affected, m.callback_id, l.is_internal
FROM measured AS m
JOIN main.callback_label AS l ON m.callback_id = l.callback_id
ORDER BY m.run_id, m.preempted_ns DESC, m.runnable_ns DESC, l.node, l.label, m.callback_id
