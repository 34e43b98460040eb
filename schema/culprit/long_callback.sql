-- description: Callbacks that run long on a path, or behind which others wait. How long: as long as
--     those that are to blame for half of the time above the usual.
-- grain: one row per node and callback
-- reads: callback_cpu, callback_use, harm, thread_load
-- kind: inline
WITH judged AS (
    SELECT
        h.*, u.usual_ns, u.run_ns, u.long_ns, u.long_instances, u.instances, u.period_ns, l.load,
        -- What matters to the callback itself, or to the one that waits for it longest.
        least(u.limit_ns, w.limit_ns) AS limit_ns
    FROM harm AS h
    JOIN callback_use AS u ON h.node = u.node AND h.callback = u.callback
    LEFT JOIN callback_use AS w
        ON h.waiting_node = w.node AND h.waiting_callback = w.callback
    LEFT JOIN thread_load AS l ON h.node = l.node AND h.callback = l.callback
    WHERE h.matters
),
-- One that always takes long is not said to do so at times.
named AS (
    SELECT
        *,
        usual_ns < limit_ns AND long_ns IS NOT NULL AS is_at_times,
        CASE
            WHEN usual_ns >= limit_ns THEN usual_ns
            WHEN long_ns IS NOT NULL THEN long_ns
            ELSE run_ns
        END AS takes_ns
    FROM judged
)
SELECT
    h.node, h.callback, h.function, h.path, h.topic_name, h.harm_ns, h.p95_ns, h.lost, h.published,
    h.takes_ns AS run_ns,
    h.usual_ns,
    CASE WHEN h.is_at_times THEN round(h.instances / h.long_instances)::BIGINT END AS every,
    h.instances AS count,
    h.period_ns, h.load, h.waiting_node, h.waiting_callback, h.limit_ns,
    [h.node || h.callback, h.node || ' waits', coalesce(h.waiting_node, h.node) || ' waits']
    AS claims,
    c.run_ns AS measured_ns,
    c.running_ns, c.waiting_ns, c.sleeping_ns, c.disk_ns
FROM named AS h
LEFT JOIN callback_cpu AS c ON h.node = c.node AND h.callback = c.callback
-- What a coroutine awaits on the path is no time that it takes.
WHERE h.takes_ns >= h.limit_ns
