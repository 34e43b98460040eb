-- description: Callback objects, numbered in the order in which they were made. One whose creation
--     was not traced counts from its first instance.
-- grain: one row per callback object
-- when: staging.callback_known, staging.callback_binding
WITH every_callback AS (
    SELECT
        event_id, event_id AS callback_event_id, process_id, kind, subscription_event_id,
        timer_event_id, service_event_id, callback_handle, symbol, created_ns
    FROM staging.callback_known
    UNION ALL
    SELECT
        min(start_event_id), NULL, process_id, 'unknown', NULL, NULL, NULL, callback_handle, NULL,
        NULL
    FROM staging.callback_binding
    WHERE callback_event_id IS NULL
    GROUP BY process_id, callback_handle
)
SELECT row_number() OVER (ORDER BY event_id) AS callback_id, * FROM every_callback
