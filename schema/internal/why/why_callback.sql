-- title: What callbacks on paths did
-- description: How long the callbacks on the paths of an explanation ran and waited, and for what.
--     95 % of their instances took no longer.
-- grain: one row per node and callback
-- reads: breakdown, explained_wait
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
-- column: service_name VARCHAR  The service that it waited for longest
-- column: server
-- column: served_ns BIGINT [ns]  Median time in which it answers; NULL: not known
-- column: is_recorded BOOLEAN  Requests show it; else that its callback ran within this one
-- column: own_ns BIGINT [ns]  Before it, its executor ran the callback for earlier messages
-- column: other_ns BIGINT [ns]  Before it, its executor ran other callbacks, at most
-- column: beside_ns BIGINT [ns]  Before it, one other callback ran, on whatever thread of its
--     executor
-- column: other_run_ns BIGINT [ns]  How long an instance of another callback took of that
-- column: other_id BIGINT  The other callback that ran longest
WITH chosen AS MATERIALIZED (
    SELECT callback_id, node, label
    FROM main.callback_label
    WHERE list_contains($runs, run_id)
        AND (node, label) IN (SELECT (node, what) FROM breakdown)
),
-- Releases before Kilted record no requests. Then a callback waits for a service if its process has
-- a client of it, and nearly all that the service did happened in the callback.
within AS (
    SELECT
        i.callback_instance_id, c.node, c.label, v.service_id, v.service_name, v.process_id,
        v.node_id,
        j.end_ns - j.start_ns AS served_ns
    FROM chosen AS c
    JOIN main.callback_instance AS i ON c.callback_id = i.callback_id
    -- A process may have several clients of one service.
    JOIN (SELECT DISTINCT run_id, process_id, service_name FROM main.client) AS q
        ON i.process_id = q.process_id
    JOIN main.service AS v ON q.run_id = v.run_id AND q.service_name = v.service_name
    ANTI JOIN main.request AS r ON v.service_id = r.service_id
    JOIN main.callback AS s ON v.service_id = s.service_id
    JOIN main.callback_instance AS j
        ON s.callback_id = j.callback_id AND i.start_ns < j.start_ns AND i.end_ns > j.end_ns
),
ran_at_all AS (
    SELECT
        s.service_id,
        count(*) AS instances
    FROM main.callback AS s
    JOIN main.callback_instance AS j ON s.callback_id = j.callback_id
    WHERE s.service_id IN (SELECT service_id FROM within)
    GROUP BY s.service_id
),
call AS MATERIALIZED (
    SELECT
        w.callback_instance_id, c.node, c.label, w.service_name, w.server, w.served_ns,
        w.returned_ns - w.sent_ns AS call_ns,
        true AS is_recorded
    FROM main.waited_call AS w
    JOIN main.callback_instance AS i ON w.callback_instance_id = i.callback_instance_id
    JOIN chosen AS c ON i.callback_id = c.callback_id
    WHERE $has_calls AND list_contains($runs, w.run_id)
    UNION ALL
    SELECT
        w.callback_instance_id, w.node, w.label, w.service_name,
        main.node_label(n.full_name, r.name, r.pid),
        w.served_ns, w.served_ns, false
    FROM within AS w
    JOIN ran_at_all AS a ON w.service_id = a.service_id
    JOIN main.process AS r ON w.process_id = r.process_id
    LEFT JOIN main.node AS n ON w.node_id = n.node_id
    QUALIFY count(*) OVER (PARTITION BY w.node, w.label, w.service_id) >= 0.9 * a.instances
),
meanwhile AS (
    SELECT
        w.callback_instance_id, c.node, c.label,
        unnest(w.meanwhile_callback_ids) AS other_id,
        unnest(w.meanwhile_ns) AS overlap_ns,
        unnest(w.meanwhile_instances) AS instances
    FROM explained_wait AS w
    JOIN chosen AS c ON w.callback_id = c.callback_id
    WHERE w.start_ns >= $start_ns AND w.start_ns < $end_ns
),
-- What took the CPU from a callback meanwhile is to blame for the rest, where the kernel shows it.
computed AS (
    SELECT
        i.callback_id,
        quantile_disc(i.end_ns - i.start_ns - s.preempted_ns - s.runnable_ns, 0.95) AS computed_ns
    FROM main.callback_schedule AS s
    JOIN main.callback_instance AS i ON s.callback_instance_id = i.callback_instance_id
    WHERE $has_kernel AND i.callback_id IN (SELECT other_id FROM meanwhile)
        AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
    GROUP BY i.callback_id
),
ran AS MATERIALIZED (
    SELECT
        m.callback_instance_id, m.node, m.label, m.other_id,
        least(m.overlap_ns, m.instances * p.computed_ns) AS overlap_ns,
        m.instances,
        o.callback_id IS NOT NULL AS is_own
    FROM meanwhile AS m
    LEFT JOIN computed AS p ON m.other_id = p.callback_id
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
        c.node, c.label,
        i.end_ns - i.start_ns AS run_ns,
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
        coalesce(m.beside_ns, 0) AS beside_ns,
        coalesce(m.other_run_ns, 0) AS other_run_ns
    FROM chosen AS c
    JOIN main.callback_instance AS i ON c.callback_id = i.callback_id
    LEFT JOIN (FROM main.callback_schedule WHERE $has_kernel) AS s
        ON i.callback_instance_id = s.callback_instance_id
    LEFT JOIN explained_wait AS w ON i.callback_instance_id = w.callback_instance_id
    LEFT JOIN (
        SELECT
            callback_instance_id,
            sum(call_ns)::BIGINT AS call_ns
        FROM call
        GROUP BY callback_instance_id
    ) AS q
        ON i.callback_instance_id = q.callback_instance_id
    LEFT JOIN (
        SELECT
            callback_instance_id,
            sum(overlap_ns) FILTER (WHERE is_own)::BIGINT AS own_ns,
            sum(overlap_ns) FILTER (WHERE NOT is_own)::BIGINT AS sum_ns,
            max(overlap_ns) FILTER (WHERE NOT is_own) AS beside_ns,
            max(overlap_ns // instances) FILTER (WHERE NOT is_own) AS other_run_ns
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
        quantile_disc(beside_ns, 0.95) AS beside_ns,
        quantile_disc(other_run_ns, 0.95) AS other_run_ns
    FROM instance
    GROUP BY node, label
)
SELECT
    m.node, m.label, m.usual_ns, m.run_ns, m.period_ns, m.computed_ns, m.cpu_ns, t.cpu_by,
    m.call_ns, q.service_name, q.server, q.served_ns, q.is_recorded, m.own_ns, m.other_ns,
    m.beside_ns, m.other_run_ns, o.other_id
FROM measured AS m
LEFT JOIN (
    SELECT
        node, label,
        arg_max(name, total_ns) AS cpu_by
    FROM (
        SELECT
            node, label,
            sum(length_ns) AS total_ns,
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
    SELECT
        node, label, service_name, server, is_recorded,
        quantile_disc(served_ns, 0.5) AS served_ns
    FROM call
    GROUP BY node, label, service_name, server, is_recorded
    QUALIFY row_number() OVER (
        PARTITION BY node, label ORDER BY sum(call_ns) DESC, service_name, server
    ) = 1
) AS q
    ON m.node = q.node AND m.label = q.label
LEFT JOIN (
    SELECT
        node, label,
        arg_max(other_id, total_ns) AS other_id
    FROM (
        SELECT
            node, label, other_id,
            sum(overlap_ns) AS total_ns
        FROM ran
        WHERE NOT is_own
        GROUP BY node, label, other_id
    )
    GROUP BY node, label
) AS o
    ON m.node = o.node AND m.label = o.label
