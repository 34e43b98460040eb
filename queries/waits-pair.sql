-- name: waits-pair
-- title: Which callbacks keep which others waiting
-- description: For every pair of callbacks of one executor: how long one ran while the other
--     waited. The literature calls this interference, or blocking if the one that ran should not
--     have come first; callbacks are never interrupted. Bounds are those of waits. Threads
--     of an executor that ran the other callback at once count once, but for thread_max.
-- grain: one row per waiting callback and callback that ran meanwhile
-- column: run_id BIGINT             Run
-- column: node VARCHAR [node]  Node of the callback that waited
-- column: callback VARCHAR [callback]  What triggers it
-- column: meanwhile_node VARCHAR [node]  Node of the callback that ran
-- column: meanwhile_callback VARCHAR [callback]  What triggers it
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
-- brief: node, meanwhile_node, worst_ns, share, callback, meanwhile_callback, waits,
--     overlap_max_ns, overlap_min_ns, instances
WITH waited AS MATERIALIZED (
    SELECT
        run_id, callback_instance_id, callback_id, meanwhile_callback_ids, meanwhile_ns,
        meanwhile_certain_ns, meanwhile_thread_ns, meanwhile_instances
    FROM main.executor_wait_explained($runs)
    WHERE start_ns >= $start_ns AND start_ns < $end_ns
),
pair AS (
    SELECT
        run_id,
        callback_id,
        unnest(meanwhile_callback_ids) AS meanwhile_callback_id,
        unnest(meanwhile_instances) AS instances,
        unnest(meanwhile_certain_ns) AS overlap_min_ns,
        unnest(meanwhile_ns) AS overlap_max_ns,
        unnest(meanwhile_thread_ns) AS thread_max_ns
    FROM waited
),
measured AS (
    SELECT
        run_id,
        callback_id,
        meanwhile_callback_id,
        count(*) AS waits,
        sum(instances)::BIGINT AS instances,
        sum(overlap_min_ns)::BIGINT AS overlap_min_ns,
        sum(overlap_max_ns)::BIGINT AS overlap_max_ns,
        max(overlap_max_ns) AS worst_ns,
        sum(thread_max_ns)::BIGINT AS thread_max_ns
    FROM pair
    GROUP BY run_id, callback_id, meanwhile_callback_id
)
SELECT
    m.run_id,
    l.node,
    l.label AS callback,
    o.node AS meanwhile_node,
    o.label AS meanwhile_callback,
    m.waits,
    m.instances,
    m.overlap_min_ns,
    m.overlap_max_ns,
    m.worst_ns,
    m.thread_max_ns,
    m.overlap_max_ns / sum(m.overlap_max_ns) OVER (PARTITION BY m.callback_id) AS share,
    m.callback_id,
    m.meanwhile_callback_id,
    l.is_internal
FROM measured AS m
JOIN main.callback_label AS l ON m.callback_id = l.callback_id
JOIN main.callback_label AS o ON m.meanwhile_callback_id = o.callback_id
ORDER BY m.run_id, m.worst_ns DESC, m.callback_id, m.meanwhile_callback_id
