-- title: What woke the threads of callbacks that slept
-- description: What ended the sleeps of callbacks that sleep most of the time that they take, and
--     which callback the thread ran that woke them, or had just run. Without a kernel trace: which
--     callback of the process ran meanwhile and ended when they went on.
-- grain: one row per node and callback
-- reads: callback_cpu, callback_name, noticed
-- column: node VARCHAR  Node of the callback that slept
-- column: callback VARCHAR  What triggers it
-- column: kind VARCHAR  What woke it: 'thread', 'timer', 'interrupt', 'softirq' or 'unknown'
-- column: sleep_ns BIGINT [ns]  95 % of the sleeps took no longer
-- column: other_node VARCHAR  Node of the callback that the waking thread ran; NULL: none
-- column: other_callback VARCHAR  What triggers that
-- column: other_function VARCHAR  Its function
-- column: is_same_process BOOLEAN  Both are callbacks of one process
-- column: is_supposed BOOLEAN  Times alone say so, no kernel trace
WITH instance AS (
    SELECT
        n.node, n.callback, n.process_id, i.callback_instance_id, i.thread_id, i.start_ns,
        i.end_ns, i.cpu_ns, i.cpu_source
    FROM main.callback_instance AS i
    JOIN callback_name AS n ON i.callback_id = n.callback_id
    JOIN callback_cpu AS c ON n.node = c.node AND n.callback = c.callback
    WHERE list_contains($runs, i.run_id) AND i.depth = 1
        AND c.sleeping_ns > 0.5 * c.run_ns
        AND i.start_ns >= $start_ns AND i.start_ns < $end_ns
),
slept AS (
    SELECT
        i.node, i.callback, i.process_id, s.waker_kind, s.waker_thread_id, s.end_ns,
        s.end_ns - s.start_ns AS sleep_ns
    FROM main.thread_state AS s
    ASOF JOIN instance AS i ON s.thread_id = i.thread_id AND s.start_ns >= i.start_ns
    WHERE list_contains($runs, s.run_id) AND s.state = 'sleeping' AND s.start_ns < i.end_ns
),
run AS (
    SELECT process_id, thread_id, start_ns, end_ns, callback_id
    FROM main.callback_instance
    WHERE list_contains($runs, run_id) AND depth = 1
),
-- Without a kernel trace, with the callback of another thread of the process that ran for most of
-- the sleep and ended as it did: a lock is given back right before, or right after. Who began first
-- holds it.
unseen AS (
    SELECT
        i.node, i.callback, i.sleep_ns,
        CASE
            WHEN j.start_ns < i.start_ns
                AND j.end_ns >= i.end_ns - i.close_ns
                AND 2 * (least(j.end_ns, i.end_ns) - greatest(j.start_ns, i.start_ns)) > i.sleep_ns
                THEN j.callback_id
        END AS other_id
    FROM (
        SELECT
            i.*,
            i.end_ns - i.start_ns - i.cpu_ns AS sleep_ns,
            i.cpu_ns + greatest(n.least_ns, n.of_path * sleep_ns)::BIGINT AS close_ns
        FROM instance AS i
        CROSS JOIN noticed AS n
        WHERE i.cpu_source = 'clock' AND i.end_ns - i.start_ns - i.cpu_ns >= n.least_ns
    ) AS i
    JOIN (SELECT DISTINCT process_id, thread_id FROM run) AS t
        ON i.process_id = t.process_id AND i.thread_id <> t.thread_id
    ASOF LEFT JOIN run AS j ON t.thread_id = j.thread_id AND i.end_ns + i.close_ns >= j.end_ns
    QUALIFY row_number() OVER (
        PARTITION BY i.callback_instance_id ORDER BY other_id IS NULL, abs(i.end_ns - j.end_ns)
    ) = 1
),
woken AS (
    SELECT
        s.node, s.callback, s.sleep_ns, s.waker_kind,
        o.node AS other_node,
        o.callback AS other_callback,
        o.function AS other_function,
        s.process_id = o.process_id AS is_same_process,
        false AS is_supposed
    FROM slept AS s
    CROSS JOIN noticed AS n
    -- An interrupt has only interrupted what the thread ran.
    ASOF LEFT JOIN run AS j
        ON CASE WHEN s.waker_kind = 'thread' THEN s.waker_thread_id END = j.thread_id
        AND s.end_ns >= j.start_ns
    LEFT JOIN callback_name AS o
        ON j.callback_id = o.callback_id AND s.end_ns <= j.end_ns + n.least_ns
    UNION ALL
    SELECT
        u.node, u.callback, u.sleep_ns,
        CASE WHEN o.node IS NULL THEN 'unknown' ELSE 'thread' END,
        o.node, o.callback, o.function, true, true
    FROM unseen AS u
    LEFT JOIN callback_name AS o ON u.other_id = o.callback_id
)
SELECT
    node, callback,
    arg_max_null(waker_kind, total_ns) AS kind,
    arg_max(p95_ns, total_ns) AS sleep_ns,
    arg_max_null(other_node, total_ns) AS other_node,
    arg_max_null(other_callback, total_ns) AS other_callback,
    arg_max_null(other_function, total_ns) AS other_function,
    arg_max_null(is_same_process, total_ns) AS is_same_process,
    bool_and(is_supposed) AS is_supposed
FROM (
    SELECT
        node, callback, waker_kind, other_node, other_callback, other_function, is_same_process,
        bool_and(is_supposed) AS is_supposed,
        sum(sleep_ns) AS total_ns,
        quantile_disc(sleep_ns, 0.95) AS p95_ns
    FROM woken
    -- Some wakings may be missing in the trace.
    WHERE waker_kind IS NOT NULL
    GROUP BY
        node, callback, waker_kind, other_node, other_callback, other_function, is_same_process
)
GROUP BY node, callback
