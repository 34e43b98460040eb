-- title: Which callbacks keep which others waiting
-- description: For every pair of callbacks of one executor: how long one ran while the other
--     waited. The literature calls this interference, or blocking if the one that ran should not
--     have come first; callbacks are never interrupted. Bounds are those of waits. Threads
--     of an executor that ran the other callback at once count once, but for thread_max. Where the
--     kernel was traced, what had the CPU while the thread waited for one has rows of its own.
-- grain: one row per waiting callback and callback that ran meanwhile, or thread that had the CPU
-- reads: exact_arrival
-- column: run_id
-- column: node VARCHAR [node]  Node of the callback that waited
-- column: callback
-- column: meanwhile_node VARCHAR [node]  Node of the callback that ran
-- column: meanwhile_callback VARCHAR [callback]  What triggers it
-- column: meanwhile_thread VARCHAR  Instead of a callback: thread that had the CPU for which the
--     thread of the waiting callback waited, outside of callbacks; 'idle CPU': none, for a
--     millisecond or more (main.withheld_cpu)
-- column: waits BIGINT              Waits during which the other callback may have run
-- column: instances BIGINT          Callback instances that ran during these waits
-- column: overlap_min_ns BIGINT [ns]  How long it ran during waits, at least
-- column: overlap_max_ns BIGINT [ns]  How long it ran during waits, at most
-- column: worst_ns BIGINT [ns]      Longest time that it ran during one wait
-- column: thread_max_ns BIGINT [ns]  Time of all threads that ran it during waits, at most
-- column: share DOUBLE [share]      Share of all that ran while the callback waited, 0 to 1
-- column: callback_id BIGINT        Identity of the callback that waited
-- column: meanwhile_callback_id BIGINT  Identity of the callback that ran
-- column: is_internal BOOLEAN       The callback that waited is infrastructure of ROS
-- brief: node, meanwhile_node, worst_ns, share, meanwhile_thread, callback, meanwhile_callback,
--     waits, overlap_max_ns, overlap_min_ns, instances
CREATE OR REPLACE TEMP TABLE explained_wait AS
SELECT
    run_id, callback_instance_id, executor_id, callback_id, earliest_ns, latest_ns, start_ns,
    busy_min_ns, busy_max_ns,
    held_max_ns, run_queue_ns, preempted_ns, meanwhile_callback_ids, meanwhile_ns,
    meanwhile_certain_ns, meanwhile_thread_ns, meanwhile_instances, cpu_taken_by, cpu_taken_ns
FROM main.executor_wait_explained(
    $runs, arrivals := 'exact_arrival', has_kernel := $has_kernel, has_teams := $has_teams
);

WITH pair AS (
    SELECT
        run_id, callback_id,
        unnest(meanwhile_callback_ids) AS meanwhile_callback_id,
        unnest(meanwhile_instances) AS instances,
        unnest(meanwhile_certain_ns) AS overlap_min_ns,
        unnest(meanwhile_ns) AS overlap_max_ns,
        unnest(meanwhile_thread_ns) AS thread_max_ns
    FROM explained_wait
    WHERE start_ns >= $start_ns AND start_ns < $end_ns
),
taken AS (
    SELECT
        run_id, callback_id,
        unnest(cpu_taken_by) AS name,
        unnest(cpu_taken_ns) AS length_ns
    FROM explained_wait
    WHERE start_ns >= $start_ns AND start_ns < $end_ns
),
measured AS (
    SELECT
        run_id, callback_id, meanwhile_callback_id,
        NULL::VARCHAR AS meanwhile_thread,
        count(*) AS waits,
        sum(instances)::BIGINT AS instances,
        sum(overlap_min_ns)::BIGINT AS overlap_min_ns,
        sum(overlap_max_ns)::BIGINT AS overlap_max_ns,
        max(overlap_max_ns) AS worst_ns,
        sum(thread_max_ns)::BIGINT AS thread_max_ns
    FROM pair
    GROUP BY run_id, callback_id, meanwhile_callback_id
    UNION ALL
    SELECT
        run_id, callback_id, NULL, name,
        count(*),
        NULL,
        sum(length_ns)::BIGINT,
        sum(length_ns)::BIGINT,
        max(length_ns),
        NULL
    FROM taken
    GROUP BY run_id, callback_id, name
)
SELECT
    m.run_id, l.node,
    l.label AS callback,
    o.node AS meanwhile_node,
    o.label AS meanwhile_callback,
    m.meanwhile_thread, m.waits, m.instances, m.overlap_min_ns, m.overlap_max_ns, m.worst_ns,
    m.thread_max_ns,
    m.overlap_max_ns / sum(m.overlap_max_ns) OVER (PARTITION BY m.callback_id) AS share,
    m.callback_id, m.meanwhile_callback_id, l.is_internal
FROM measured AS m
JOIN main.callback_label AS l ON m.callback_id = l.callback_id
LEFT JOIN main.callback_label AS o ON m.meanwhile_callback_id = o.callback_id
ORDER BY
    m.run_id, m.worst_ns DESC, m.callback_id, m.meanwhile_callback_id NULLS LAST,
    m.meanwhile_thread
