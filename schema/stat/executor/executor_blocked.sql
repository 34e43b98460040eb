-- name: derive.executor_blocked
-- description: Callback instances that kept others from starting although a thread of their
--     executor was free, because a callback of one excludes that of the other. With the sum of
--     all such time before.
-- grain: one row per callback instance in an executor of several threads that excludes some
WITH run AS (
    SELECT
        r.run_id, r.executor_id, e.kind, e.exclusion_id, r.callback_instance_id, r.start_ns,
        r.end_ns
    FROM derive.executor_run AS r
    JOIN derive.executor_size AS s ON r.executor_id = s.executor_id
    JOIN derive.callback_exclusion AS e ON r.callback_id = e.callback_id
    WHERE r.end_ns > r.start_ns AND s.thread_count > 1
),
started AS (
    SELECT
        r.run_id, r.executor_id, r.kind, r.exclusion_id, r.callback_instance_id, r.start_ns,
        r.end_ns,
        coalesce(b.before_ns + least(r.start_ns, b.end_ns) - b.start_ns, 0) AS start_busy_ns
    FROM run AS r
    ASOF LEFT JOIN derive.executor_full AS b
        ON r.executor_id = b.executor_id AND r.start_ns >= b.start_ns
),
ended AS (
    SELECT
        r.run_id, r.kind, r.exclusion_id, r.callback_instance_id, r.start_ns, r.end_ns,
        r.start_busy_ns,
        coalesce(b.before_ns + least(r.end_ns, b.end_ns) - b.start_ns, 0) AS end_busy_ns
    FROM started AS r
    ASOF LEFT JOIN derive.executor_full AS b
        ON r.executor_id = b.executor_id AND r.end_ns >= b.start_ns
)
SELECT
    run_id,
    kind,
    exclusion_id,
    start_ns,
    end_ns,
    start_busy_ns,
    end_ns - start_ns - (end_busy_ns - start_busy_ns) AS blocked_ns,
    coalesce(sum(end_ns - start_ns - (end_busy_ns - start_busy_ns)) OVER (
        PARTITION BY run_id, kind, exclusion_id ORDER BY start_ns, callback_instance_id
        ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
    ), 0)::BIGINT AS before_ns
FROM ended
