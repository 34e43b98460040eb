-- title: What callbacks waited for
-- description: For how long callbacks waited for what else their executor ran, and for what is not
--     known. A coroutine that awaits holds its callback back if it never runs twice at once. An
--     executor of several threads keeps a callback waiting while all of them are busy, or while
--     the callback itself runs.
-- grain: one row per waiting callback and callback that ran meanwhile, and one for what is not
--     known
-- reads: callback_name, explained_wait, thread_wait
-- column: node VARCHAR  Node of the callback that waits
-- column: callback VARCHAR  What triggers it
-- column: other_node VARCHAR  Node of the callback that ran; NULL: not known
-- column: other_callback VARCHAR  What triggers it; NULL: not known
-- column: is_cpu BOOLEAN  Its thread was ready, and had no CPU
-- column: share DOUBLE  Share of all the time that the callback waits, 0 to 1
-- column: p95_ns BIGINT [ns]  95 % of its instances waited no longer for this
WITH wait AS MATERIALIZED (
    SELECT
        w.callback_instance_id, w.start_ns, l.node, l.callback,
        w.start_ns - coalesce(w.earliest_ns, w.latest_ns) AS wait_ns,
        coalesce(w.earliest_ns, w.latest_ns) AS ready_ns,
        greatest(w.busy_max_ns, 0) AS busy_ns,
        coalesce(
            w.run_queue_ns + w.preempted_ns,
            CASE WHEN u.end_ns >= w.start_ns
                THEN u.before_ns + u.waiting_ns - f.before_ns END,
            0
        ) AS cpu_ns,
        -- All waits that begin between two samples share what these say.
        CASE WHEN w.run_queue_ns IS NULL THEN (w.thread_id, f.start_ns) END AS sampled,
        w.meanwhile_callback_ids, w.meanwhile_ns
    FROM explained_wait AS w
    JOIN callback_name AS l ON w.callback_id = l.callback_id
    ASOF LEFT JOIN thread_wait AS f
        ON w.thread_id = f.thread_id AND coalesce(w.earliest_ns, w.latest_ns) >= f.start_ns
    ASOF LEFT JOIN thread_wait AS u ON w.thread_id = u.thread_id AND w.start_ns > u.start_ns
    LEFT JOIN (
        SELECT
            thread_id,
            min(start_ns) AS start_ns
        FROM main.callback_instance
        WHERE list_contains($runs, run_id)
        GROUP BY thread_id
    ) AS b
        ON w.thread_id = b.thread_id
    WHERE w.start_ns >= $start_ns AND w.start_ns < $end_ns
        -- What was there before its thread ran any callback waited for the start.
        AND coalesce(coalesce(w.earliest_ns, w.latest_ns) >= b.start_ns, true)
),
-- While it awaits, its callback does not run.
awaiting AS (
    SELECT
        l.node, l.callback, f.start_ns,
        max(s.start_ns) AS end_ns
    FROM main.callback_instance AS s
    JOIN main.callback_instance AS f ON s.continues_id = f.callback_instance_id
    JOIN callback_name AS l ON f.callback_id = l.callback_id
    -- Of another name is a job on another thread.
    JOIN callback_name AS o ON s.callback_id = o.callback_id AND l.callback = o.callback
    WHERE list_contains($runs, s.run_id)
    GROUP BY f.callback_instance_id, l.node, l.callback, f.start_ns
),
running AS (
    SELECT n.node, n.callback, i.start_ns, i.end_ns
    FROM main.callback_instance AS i
    JOIN callback_name AS n ON i.callback_id = n.callback_id
    WHERE $has_teams AND list_contains($runs, i.run_id)
),
-- With the sum of all such time before.
alone AS (
    SELECT
        node, callback, start_ns, end_ns,
        coalesce(sum(end_ns - start_ns) OVER (
            PARTITION BY node, callback ORDER BY start_ns
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ), 0)::BIGINT AS before_ns
    FROM awaiting
    WHERE (node, callback) NOT IN (
        SELECT (w.node, w.callback)
        FROM wait AS w
        ASOF JOIN awaiting AS a
            ON w.node = a.node AND w.callback = a.callback AND w.start_ns > a.start_ns
        WHERE w.start_ns < a.end_ns
    )
),
meanwhile AS (
    SELECT
        m.callback_instance_id, m.node, m.callback, m.start_ns, m.wait_ns, m.busy_ns,
        l.node AS other_node,
        l.callback AS other_callback,
        m.overlap_ns,
        m.node = l.node AND m.callback = l.callback AS is_own
    FROM (
        SELECT
            callback_instance_id, node, callback, start_ns, wait_ns, busy_ns,
            unnest(meanwhile_callback_ids) AS other_id,
            unnest(meanwhile_ns) AS overlap_ns
        FROM wait
    ) AS m
    JOIN callback_name AS l ON m.other_id = l.callback_id
    UNION ALL
    SELECT
        w.callback_instance_id, w.node, w.callback, w.start_ns, w.wait_ns, w.wait_ns, w.node,
        w.callback,
        derive.passed_ns(a, w.start_ns) - derive.passed_ns(e, w.ready_ns),
        true
    FROM wait AS w
    ASOF JOIN alone AS a
        ON w.node = a.node AND w.callback = a.callback AND w.start_ns >= a.start_ns
    ASOF LEFT JOIN alone AS e
        ON w.node = e.node AND w.callback = e.callback AND w.ready_ns >= e.start_ns
),
summed AS MATERIALIZED (
    SELECT
        callback_instance_id, node, callback, other_node, other_callback, is_own,
        any_value(start_ns) AS start_ns,
        any_value(wait_ns) AS wait_ns,
        max(busy_ns) AS busy_ns,
        sum(overlap_ns) AS overlap_ns
    FROM meanwhile
    GROUP BY callback_instance_id, node, callback, other_node, other_callback, is_own
),
-- One that begins while the other runs is in another callback group.
together AS (
    SELECT DISTINCT s.node, s.callback, s.other_node, s.other_callback
    FROM summed AS s
    ASOF JOIN running AS r
        ON s.other_node = r.node AND s.other_callback = r.callback AND s.start_ns > r.start_ns
    WHERE $has_teams AND NOT s.is_own AND s.start_ns < r.end_ns
),
-- What ran side by side on several threads may be more than the executor was busy.
bounded AS (
    SELECT
        s.callback_instance_id, s.node, s.callback, s.other_node, s.other_callback, s.wait_ns,
        s.is_own,
        CASE
            WHEN s.is_own OR t.node IS NULL THEN s.overlap_ns
            ELSE s.overlap_ns * least(
                1,
                greatest(
                    s.busy_ns - coalesce(sum(s.overlap_ns) FILTER (WHERE s.is_own) OVER each, 0), 0
                ) / nullif(sum(s.overlap_ns) FILTER (WHERE NOT s.is_own) OVER each, 0)
            )
        END AS overlap_ns
    FROM summed AS s
    LEFT JOIN together AS t
        ON s.node = t.node AND s.callback = t.callback
        AND s.other_node = t.other_node AND s.other_callback = t.other_callback
    WINDOW each AS (PARTITION BY s.callback_instance_id)
),
-- All of it together is no more than the wait. A backlog is worked off with pauses of the executor
-- between: they belong to the wait behind earlier messages.
shared AS (
    SELECT
        callback_instance_id, node, callback, other_node, other_callback,
        overlap_ns * CASE
            WHEN sum(overlap_ns) OVER each > wait_ns
                OR sum(overlap_ns) FILTER (WHERE is_own) OVER each > 0.3 * wait_ns
                THEN wait_ns / sum(overlap_ns) OVER each
            ELSE 1
        END AS overlap_ns
    FROM bounded
    WHERE overlap_ns > 0
    WINDOW each AS (PARTITION BY callback_instance_id)
),
rest AS (
    SELECT
        w.node, w.callback,
        greatest(w.wait_ns - coalesce(b.overlap_ns, 0), 0) AS rest_ns,
        CASE
            WHEN w.sampled IS NULL THEN w.cpu_ns
            ELSE rest_ns
                * least(1, w.cpu_ns / nullif(sum(rest_ns) OVER (PARTITION BY w.sampled), 0))
        END AS cpu_ns
    FROM wait AS w
    LEFT JOIN (
        SELECT
            callback_instance_id,
            sum(overlap_ns) AS overlap_ns
        FROM shared
        GROUP BY callback_instance_id
    ) AS b
        ON w.callback_instance_id = b.callback_instance_id
),
piece AS (
    SELECT
        node, callback, other_node, other_callback,
        false AS is_cpu,
        overlap_ns
    FROM shared
    UNION ALL
    SELECT
        node, callback, NULL, NULL, true,
        least(cpu_ns, rest_ns)
    FROM rest
    WHERE cpu_ns > 0
    UNION ALL
    SELECT
        node, callback, NULL, NULL, false,
        greatest(rest_ns - cpu_ns, 0)
    FROM rest
)
SELECT
    p.node, p.callback, p.other_node, p.other_callback, p.is_cpu,
    sum(p.overlap_ns) / nullif(any_value(w.wait_ns), 0) AS share,
    -- All others waited 0 for it.
    coalesce(
        list_sort(list(p.overlap_ns), 'DESC')[1 + any_value(w.instances) // 20], 0
    )::BIGINT AS p95_ns
FROM piece AS p
JOIN (
    SELECT
        node, callback,
        count(*) AS instances,
        sum(wait_ns) AS wait_ns
    FROM wait
    GROUP BY node, callback
) AS w
    ON p.node = w.node AND p.callback = w.callback
GROUP BY p.node, p.callback, p.other_node, p.other_callback, p.is_cpu
