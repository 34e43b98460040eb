-- name: staging.executor
-- description: Executors, deduced from threads: stock traces do not name them. One thread with
--     executor events is a single-threaded executor, one without may be any.
-- grain: one row per executor
-- needs: staging.executor_member
SELECT
    row_number() OVER (ORDER BY first_thread_id) AS executor_id,
    any_value(process_id) AS process_id,
    CASE
        WHEN count(*) > 1 THEN 'multi_threaded'
        WHEN bool_or(is_spinning) THEN 'single_threaded'
        ELSE 'unknown'
    END AS kind,
    true AS is_inferred,
    first_thread_id
FROM staging.executor_member
GROUP BY first_thread_id
