-- description: Stretches of time in which no thread of an executor was free to start a callback:
--     each of them ran one. With the sum of all such time before. Of an executor of one
--     thread each is one callback instance.
-- grain: one row per stretch in which all threads of an executor ran callbacks
SELECT
    run_id, executor_id, start_ns, end_ns, NULL::BIGINT AS callback_instance_id,
    NULL::BIGINT AS previous_end_ns, before_ns
FROM derive.executor_full
UNION ALL
SELECT
    r.run_id, r.executor_id, r.start_ns, r.end_ns, r.callback_instance_id,
    lag(r.end_ns) OVER in_time,
    coalesce(sum(r.end_ns - r.start_ns) OVER (
        in_time ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
    ), 0)::BIGINT
FROM derive.executor_run AS r
JOIN derive.executor_size AS s ON r.executor_id = s.executor_id
WHERE s.thread_count = 1 AND r.end_ns > r.start_ns
WINDOW in_time AS (PARTITION BY r.run_id, r.executor_id ORDER BY r.start_ns)
