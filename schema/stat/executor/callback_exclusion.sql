-- description: Which callbacks of executors of several threads never run at the same time: those
--     of a mutually exclusive callback group, where the trace tells of groups. Elsewhere a
--     callback is assumed to exclude only itself, unless it was seen to run beside itself.
-- grain: one row per callback that something excludes
WITH run AS (
    SELECT r.run_id, r.callback_id, r.start_ns, r.end_ns, r.callback_instance_id
    FROM derive.executor_run AS r
    JOIN derive.executor_size AS s ON r.executor_id = s.executor_id
    WHERE s.thread_count > 1
),
beside AS (
    SELECT
        run_id, callback_id,
        start_ns < max(end_ns) OVER (
            PARTITION BY run_id, callback_id ORDER BY start_ns, callback_instance_id
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ) AS is_beside_itself
    FROM run
)
SELECT
    b.run_id, b.callback_id,
    CASE WHEN g.callback_group_id IS NULL THEN 'callback' ELSE 'callback_group' END AS kind,
    coalesce(g.callback_group_id, b.callback_id) AS exclusion_id
FROM beside AS b
LEFT JOIN store.callback_group_member AS m ON b.callback_id = m.callback_id
LEFT JOIN store.callback_group AS g
    ON m.callback_group_id = g.callback_group_id AND g.kind <> 'unknown'
WHERE g.kind IS NULL OR g.kind = 'mutually_exclusive'
GROUP BY b.run_id, b.callback_id, g.callback_group_id
HAVING g.callback_group_id IS NOT NULL OR NOT coalesce(bool_or(b.is_beside_itself), false)
