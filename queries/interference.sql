-- name: interference
-- title: Which callbacks keep which waiting
-- description: For every pair of callbacks of one executor how long one ran while the other waited
--     (literature: interference, or blocking where the one that ran was not to come first; no
--     callback is ever interrupted). Bounds as in executor-wait. Threads of one executor count
--     each.
-- grain: one row per waiting callback and callback that ran meanwhile
-- column: run_id BIGINT             Run
-- column: node VARCHAR              Node of the callback that waited
-- column: callback VARCHAR          What triggers it
-- column: meanwhile_node VARCHAR    Node of the callback that ran
-- column: meanwhile_callback VARCHAR  What triggers it
-- column: waits BIGINT              Waits during which it may have run
-- column: instances BIGINT          Callback instances that ran during these waits
-- column: overlap_min_ns BIGINT [ns]  How long it ran during waits, at least
-- column: overlap_max_ns BIGINT [ns]  How long it ran during waits, at most
-- column: worst_ns BIGINT [ns]      The most of it during one wait
-- column: share DOUBLE              Of all that ran while the callback waited, 0 to 1
-- column: callback_id BIGINT        Identity of the callback that waited
-- column: meanwhile_callback_id BIGINT  Identity of the callback that ran
-- column: is_internal BOOLEAN       The callback that waited is infrastructure of ROS
-- needs: main.executor_wait, main.executor_interference, main.callback_instance,
--     main.callback_label
WITH pair AS (
    SELECT
        w.run_id,
        w.callback_id,
        w.callback_instance_id,
        r.callback_id AS meanwhile_callback_id,
        count(*) AS instances,
        sum(i.certain_ns)::BIGINT AS overlap_min_ns,
        sum(i.overlap_ns)::BIGINT AS overlap_max_ns
    FROM main.executor_interference AS i
    JOIN main.executor_wait AS w ON i.callback_instance_id = w.callback_instance_id
    JOIN main.callback_instance AS r ON i.meanwhile_id = r.callback_instance_id
    WHERE list_contains($runs, i.run_id) AND w.start_ns >= $start_ns AND w.start_ns < $end_ns
    GROUP BY w.run_id, w.callback_id, w.callback_instance_id, r.callback_id
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
        max(overlap_max_ns) AS worst_ns
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
    m.overlap_max_ns / sum(m.overlap_max_ns) OVER (PARTITION BY m.callback_id) AS share,
    m.callback_id,
    m.meanwhile_callback_id,
    l.is_internal
FROM measured AS m
JOIN main.callback_label AS l ON m.callback_id = l.callback_id
JOIN main.callback_label AS o ON m.meanwhile_callback_id = o.callback_id
ORDER BY m.run_id, m.overlap_max_ns DESC, m.callback_id, m.meanwhile_callback_id
