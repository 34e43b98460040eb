-- name: internal.why_callback
-- title: What callbacks on paths did
-- description: How long the callbacks on the paths of an explanation ran and waited, and for what.
--     95 % of their instances took no longer.
-- grain: one row per node and callback
-- column: node VARCHAR  Node
-- column: label VARCHAR  What triggers the callback
-- column: usual_ns BIGINT [ns]  Median duration
-- column: run_ns BIGINT [ns]  Duration
-- column: period_ns BIGINT [ns]  Median time from one start to the next
-- column: computed_ns BIGINT [ns]  Duration without calls of services and without what others took
--     of the CPU
-- column: cpu_ns BIGINT [ns]  For how long others had the CPU, in it and before it; NULL: not
--     traced by the kernel
-- column: cpu_by VARCHAR  What had it longest
-- column: call_ns BIGINT [ns]  Calls of services for whose response it waited
-- column: service_id BIGINT  The service that it waited for longest
-- column: own_ns BIGINT [ns]  Before it, its executor ran the callback for earlier messages
-- column: other_ns BIGINT [ns]  Before it, its executor ran other callbacks, at most
-- column: beside_ns BIGINT [ns]  Before it, one other callback ran, on whatever thread of its
--     executor
-- column: other_id BIGINT  The other callback that ran longest
WITH chosen AS MATERIALIZED (
    SELECT callback_id, node, label
    FROM main.callback_label
    WHERE list_contains($runs, run_id)
        AND (node, label) IN (SELECT (node, what) FROM breakdown)
),
call AS MATERIALIZED (
    SELECT
        w.callback_instance_id, c.node, c.label, w.service_id,
        sum(w.returned_ns - w.sent_ns)::BIGINT AS call_ns
    FROM main.waited_call AS w
    JOIN main.callback_instance AS i ON w.callback_instance_id = i.callback_instance_id
    JOIN chosen AS c ON i.callback_id = c.callback_id
    WHERE $has_calls AND list_contains($runs, w.run_id)
    GROUP BY w.callback_instance_id, c.node, c.label, w.service_id
),
meanwhile AS (
    SELECT
        w.callback_instance_id, c.node, c.label,
        unnest(w.meanwhile_callback_ids) AS other_id,
        unnest(w.meanwhile_ns) AS overlap_ns
    FROM explained_wait AS w
    JOIN chosen AS c ON w.callback_id = c.callback_id
    WHERE w.start_ns >= $start_ns AND w.start_ns < $end_ns
),
ran AS MATERIALIZED (
    SELECT
        m.callback_instance_id, m.node, m.label, m.other_id, m.overlap_ns,
        o.callback_id IS NOT NULL AS is_own
    FROM meanwhile AS m
    LEFT JOIN chosen AS o
        ON m.other_id = o.callback_id AND m.node = o.node AND m.label = o.label
),
-- Of the threads that run them, whatever they ran.
taken AS (
    SELECT
        c.node, c.label,
        CASE WHEN t.thread_id IS NULL THEN coalesce(o.name, '?') ELSE t.label END AS name,
        coalesce(h.tid, o.tid) AS tid,
        sum(p.end_ns - p.start_ns) AS length_ns
    FROM (
        SELECT DISTINCT c.node, c.label, i.thread_id
        FROM main.callback_instance AS i
        JOIN chosen AS c ON i.callback_id = c.callback_id
    ) AS c
    JOIN main.preemptor AS p ON c.thread_id = p.thread_id
    LEFT JOIN main.thread_label AS t ON p.preemptor_thread_id = t.thread_id
    LEFT JOIN main.thread AS h ON p.preemptor_thread_id = h.thread_id
    LEFT JOIN main.other_thread AS o ON p.preemptor_other_thread_id = o.other_thread_id
    -- An idle CPU is not taken.
    WHERE $has_kernel
        AND p.start_ns >= $start_ns AND p.start_ns < $end_ns AND coalesce(o.tid <> 0, true)
    GROUP BY ALL
),
instance AS MATERIALIZED (
    SELECT
        c.node, c.label, i.end_ns - i.start_ns AS run_ns,
        i.start_ns - lag(i.start_ns)
            OVER (PARTITION BY i.callback_id ORDER BY i.start_ns) AS period_ns,
        s.preempted_ns + s.runnable_ns AS lost_ns,
        w.run_queue_ns + w.preempted_ns AS queued_ns,
        coalesce(q.call_ns, 0) AS call_ns,
        coalesce(m.own_ns, 0) AS own_ns,
        -- What the executor did between callbacks is the work of none.
        least(
            greatest(w.busy_max_ns - coalesce(m.own_ns, 0), 0), coalesce(m.sum_ns, 0)
        ) AS other_ns,
        coalesce(m.beside_ns, 0) AS beside_ns
    FROM chosen AS c
    JOIN main.callback_instance AS i ON c.callback_id = i.callback_id
    LEFT JOIN (FROM main.callback_schedule WHERE $has_kernel) AS s
        ON i.callback_instance_id = s.callback_instance_id
    LEFT JOIN explained_wait AS w ON i.callback_instance_id = w.callback_instance_id
    LEFT JOIN (
        SELECT callback_instance_id, sum(call_ns)::BIGINT AS call_ns
        FROM call
        GROUP BY callback_instance_id
    ) AS q
        ON i.callback_instance_id = q.callback_instance_id
    LEFT JOIN (
        SELECT
            callback_instance_id,
            sum(overlap_ns) FILTER (WHERE is_own)::BIGINT AS own_ns,
            sum(overlap_ns) FILTER (WHERE NOT is_own)::BIGINT AS sum_ns,
            max(overlap_ns) FILTER (WHERE NOT is_own) AS beside_ns
        FROM ran
        GROUP BY callback_instance_id
    ) AS m
        ON i.callback_instance_id = m.callback_instance_id
    WHERE i.start_ns >= $start_ns AND i.start_ns < $end_ns
),
measured AS (
    SELECT
        node, label,
        quantile_disc(run_ns, 0.5) AS usual_ns,
        quantile_disc(run_ns, 0.95) AS run_ns,
        quantile_disc(period_ns, 0.5) AS period_ns,
        quantile_disc(run_ns - coalesce(lost_ns, 0) - call_ns, 0.95) AS computed_ns,
        quantile_disc(coalesce(lost_ns + queued_ns, lost_ns, queued_ns), 0.95) AS cpu_ns,
        quantile_disc(call_ns, 0.95) AS call_ns,
        quantile_disc(own_ns, 0.95) AS own_ns,
        quantile_disc(other_ns, 0.95) AS other_ns,
        quantile_disc(beside_ns, 0.95) AS beside_ns
    FROM instance
    GROUP BY node, label
)
SELECT
    m.node, m.label, m.usual_ns, m.run_ns, m.period_ns, m.computed_ns, m.cpu_ns, t.cpu_by,
    m.call_ns, q.service_id, m.own_ns, m.other_ns, m.beside_ns, o.other_id
FROM measured AS m
LEFT JOIN (
    SELECT node, label, arg_max(name, total_ns) AS cpu_by
    FROM (
        SELECT
            node, label, sum(length_ns) AS total_ns,
            printf('%s (%d', name, arg_max(tid, length_ns))
            || CASE WHEN count(*) > 1 THEN printf(' and %d more)', count(*) - 1) ELSE ')' END
                AS name
        FROM taken
        GROUP BY node, label, name
    )
    GROUP BY node, label
) AS t
    ON m.node = t.node AND m.label = t.label
LEFT JOIN (
    SELECT node, label, arg_max(service_id, total_ns) AS service_id
    FROM (
        SELECT node, label, service_id, sum(call_ns) AS total_ns
        FROM call
        GROUP BY node, label, service_id
    )
    GROUP BY node, label
) AS q
    ON m.node = q.node AND m.label = q.label
LEFT JOIN (
    SELECT node, label, arg_max(other_id, total_ns) AS other_id
    FROM (
        SELECT node, label, other_id, sum(overlap_ns) AS total_ns
        FROM ran
        WHERE NOT is_own
        GROUP BY node, label, other_id
    )
    GROUP BY node, label
) AS o
    ON m.node = o.node AND m.label = o.label
