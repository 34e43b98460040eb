-- description: Executors. Stock traces do not name them: there they are deduced from their threads.
--     One thread with executor events is a single-threaded executor. One without is an events
--     executor if it was seen to serve what came first first, else it may be any.
-- grain: one row per executor
-- when: staging.executor_member, staging.executor_named
WITH deduced AS (
    SELECT
        m.first_thread_id,
        any_value(m.process_id) AS process_id,
        min(m.executor_event_id) AS executor_event_id,
        CASE
            WHEN count(*) > 1 THEN 'multi_threaded'
            WHEN bool_or(m.is_spinning) THEN 'single_threaded'
            WHEN bool_or(o.thread_id IS NOT NULL) THEN 'events'
            ELSE 'unknown'
        END AS kind
    FROM staging.executor_member AS m
    LEFT JOIN staging.executor_in_order AS o ON m.thread_id = o.thread_id
    GROUP BY m.first_thread_id
),
every_executor AS (
    SELECT
        d.first_thread_id, d.process_id, d.executor_event_id,
        CASE WHEN x.kind <> 'unknown' THEN x.kind ELSE d.kind END AS kind,
        x.event_id IS NULL AS is_inferred
    FROM deduced AS d
    LEFT JOIN staging.executor_named AS x ON d.executor_event_id = x.event_id
    UNION ALL
    SELECT NULL, x.process_id, x.event_id, x.kind, false
    FROM staging.executor_named AS x
    ANTI JOIN deduced AS d ON x.event_id = d.executor_event_id
)
SELECT
    row_number() OVER (ORDER BY first_thread_id NULLS LAST, executor_event_id) AS executor_id,
    process_id, kind, is_inferred, first_thread_id, executor_event_id
FROM every_executor
